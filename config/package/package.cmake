# Debian packages by CPack (`./run package`): posed, posed-camera, libposed-dev and python3-posed, one for each component of
# install.cmake. What a package has beyond `cmake --install` is in debian/.
set(POSED_MAINTAINER "The posed authors <posed@example.org>" CACHE STRING
  "Name and address in the packages; whoever gives them to others names their own")
set(debian ${CMAKE_CURRENT_LIST_DIR}/debian)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT ${POSED_MAINTAINER})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own, the first line of its description
set(CPACK_COMPONENTS_ALL posed camera dev python)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_THREADS 1)  # several threads cut the compressed file elsewhere
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Whatever the umask of who builds is.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
  WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_POSED_PACKAGE_NAME posed)
set(CPACK_DEBIAN_POSED_PACKAGE_SECTION utils)
set(CPACK_DEBIAN_POSED_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_POSED_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_POSED_PACKAGE_SUGGESTS "ffmpeg, librsvg2-bin, posed-camera, python3-posed, xdg-utils")
set(CPACK_DEBIAN_POSED_PACKAGE_CONTROL_EXTRA ${debian}/posed/postinst ${debian}/posed/prerm
  ${debian}/posed/postrm)
set(CPACK_DEBIAN_POSED_DESCRIPTION "pose daemon: live poses in, another style out
posed receives live poses from data gloves and motion capture systems,
changes their style, smooths them and publishes them over ZeroMQ. The style
is learned from a few clips of two groups. It shows the streams in a web
page, records and replays them, and performs gestures on a hand.")

set(CPACK_DEBIAN_CAMERA_PACKAGE_NAME posed-camera)
set(CPACK_DEBIAN_CAMERA_PACKAGE_SECTION utils)
set(CPACK_DEBIAN_CAMERA_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_CAMERA_PACKAGE_DEPENDS posed)
set(CPACK_DEBIAN_CAMERA_DESCRIPTION "hands from a webcam for the page of posed
MediaPipe Hands, with which the page that posed view serves finds hands in
the picture of a camera, in the browser.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libposed-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libprotobuf-dev (>= 3.21), libzmq3-dev")
set(CPACK_DEBIAN_DEV_DESCRIPTION "C++ client of the pose daemon posed
A header with a subscriber of poses and forward kinematics, and the messages
of posed as a static library and as protobuf schemas. Programs find it with
pkg-config posed.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-posed)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3:any, python3-protobuf, python3-zmq")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-numpy)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${debian}/python/postinst ${debian}/python/prerm)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "Python client of the pose daemon posed
Live poses with forward kinematics, control of a running daemon, and
recording to NumPy arrays.")

# package_documents(component package): copyright, changelog, and the reasons for what lintian is told to ignore.
# The time in the changelog is SOURCE_DATE_EPOCH, that of the commit.
string(TIMESTAMP changelog_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
function(package_documents component package)
  set(folder ${CMAKE_BINARY_DIR}/documents/${package})
  configure_file(${debian}/changelog.in ${folder}/changelog @ONLY)
  execute_process(COMMAND gzip -9nf ${folder}/changelog COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${debian}/copyright ${folder}/changelog.gz DESTINATION share/doc/${package} COMPONENT ${component})
  if(EXISTS ${debian}/${component}/lintian-overrides)
    install(FILES ${debian}/${component}/lintian-overrides RENAME ${package} DESTINATION share/lintian/overrides
      COMPONENT ${component})
  endif()
endfunction()
if(POSED_PACKAGE)
  package_documents(posed posed)
  package_documents(camera posed-camera)
  package_documents(dev libposed-dev)
  package_documents(python python3-posed)
endif()
include(CPack)
