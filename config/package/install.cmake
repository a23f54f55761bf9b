# What `cmake --install` puts where. The components posed, camera, dev and python are the packages posed,
# posed-camera, libposed-dev and python3-posed (package.cmake); posed-mpi is in none of them, so that nobody has to install MPI.
include(GNUInstallDirs)
set(POSED_PYTHON_DIR lib/python3/dist-packages CACHE STRING "Where the Python client is installed, below the prefix")

# Manual pages and shell completion come from the program itself, so they have every command and option.
set(generated ${CMAKE_BINARY_DIR}/generated)
add_custom_command(OUTPUT ${generated}/posed.1.gz DEPENDS posed
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${generated}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${generated}
  COMMAND posed man --out ${generated}
  COMMAND gzip -9n ${generated}/*.1
  COMMAND posed completion bash > ${generated}/posed.bash
  COMMAND posed completion zsh > ${generated}/_posed
  COMMAND posed completion fish > ${generated}/posed.fish)
add_custom_target(posed_pages ALL DEPENDS ${generated}/posed.1.gz)
add_dependencies(programs posed_pages)

# install_files(COMPONENT DESTINATION file...)
function(install_files component destination)
  install(FILES ${ARGN} DESTINATION ${destination} COMPONENT ${component})
endfunction()
# install_tree(COMPONENT DESTINATION folder pattern): the files of that pattern; a folder may be missing.
function(install_tree component destination folder pattern)
  install(DIRECTORY ${folder}/ DESTINATION ${destination} COMPONENT ${component} OPTIONAL
    FILES_MATCHING PATTERN ${pattern} PATTERN __pycache__ EXCLUDE)
endfunction()

install(TARGETS posed DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT posed)
install(TARGETS posed-fbx DESTINATION libexec/posed COMPONENT posed)
install_tree(posed ${CMAKE_INSTALL_MANDIR}/man1 ${generated} *.1.gz)
install(FILES ${generated}/posed.bash RENAME posed DESTINATION share/bash-completion/completions COMPONENT posed)
install_files(posed share/zsh/vendor-completions ${generated}/_posed)
install_files(posed share/fish/vendor_completions.d ${generated}/posed.fish)
# demo.toml names files of the source tree; `posed demo` has its own copy of it.
set(config ${CMAKE_SOURCE_DIR}/config)
install_files(posed share/posed/config ${config}/posed.toml ${config}/README.md)
foreach(folder gestures experiments stage skeletons hands devices)
  install_tree(posed share/posed/config/${folder} ${config}/${folder} *.toml)
endforeach()
install_tree(posed share/posed/config/robots ${config}/robots *.urdf)
install_files(posed share/posed/config/metrics ${config}/metrics/README.md ${config}/metrics/alerts.yml
  ${config}/metrics/dashboard.json ${config}/metrics/prometheus.yml)
install_tree(posed lib/udev/rules.d ${config}/udev *.rules)
install_tree(posed lib/systemd/system ${config}/systemd *.service)
# Both by `./run page`; without it, none. What finds hands in a camera's picture is a package of its own.
install(DIRECTORY ${CMAKE_SOURCE_DIR}/build/viewer/ DESTINATION share/posed/viewer COMPONENT posed OPTIONAL
  PATTERN camera EXCLUDE)
install_tree(camera share/posed/viewer/camera ${CMAKE_SOURCE_DIR}/build/viewer/camera *)
if(TARGET posed-mpi)
  install(TARGETS posed-mpi DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT mpi)
endif()

# The C++ client: its header, the messages as static library and as schemas.
set(messages ${CMAKE_SOURCE_DIR}/proto/wire/posed/v1)
install(FILES $<TARGET_FILE:posed_wire> RENAME libposed.a DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
install_files(dev ${CMAKE_INSTALL_INCLUDEDIR}/posed ${CMAKE_SOURCE_DIR}/proto/clients/cpp/posed_client.hpp)
install_tree(dev ${CMAKE_INSTALL_INCLUDEDIR}/posed/v1 ${CMAKE_BINARY_DIR}/proto/wire/posed/v1 *.pb.h)
install_tree(dev share/posed/proto/posed/v1 ${messages} *.proto)
# The way from the .pc file to the prefix, so that the tree works wherever it is installed.
file(RELATIVE_PATH to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
configure_file(${CMAKE_CURRENT_LIST_DIR}/posed.pc.in ${generated}.pc @ONLY)
install(FILES ${generated}.pc RENAME posed.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)

install_tree(python ${POSED_PYTHON_DIR}/posed ${CMAKE_BINARY_DIR}/python/posed *.py)
configure_file(${CMAKE_CURRENT_LIST_DIR}/egg-info.in ${generated}.egg-info @ONLY)
install(FILES ${generated}.egg-info RENAME posed-${PROJECT_VERSION}.egg-info DESTINATION ${POSED_PYTHON_DIR}
  COMPONENT python)
