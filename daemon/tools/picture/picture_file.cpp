#include "daemon/tools/picture/picture_file.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <ostream>
#include <system_error>
#include <utility>

#include "daemon/tools/picture/program.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/load_file.hpp"

namespace posed::picture {
namespace {

// A folder for files that only the drawing programs read; it goes with the object.
class TemporaryFolder {
 public:
  [[nodiscard]] static Result<std::unique_ptr<TemporaryFolder>> make() {
    std::error_code error;
    std::string name = (std::filesystem::temp_directory_path(error) / "posed-XXXXXX").string();
    if (error || ::mkdtemp(name.data()) == nullptr) {
      return fail("cannot make a temporary folder: " + errno_text(), name);
    }
    return std::unique_ptr<TemporaryFolder>(new TemporaryFolder(std::move(name)));
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  explicit TemporaryFolder(std::string path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

Result<> write_text(const std::string& text, const std::filesystem::path& path) {
  return write_whole_file(path, [&](std::ostream& out) { out << text; });
}

// So that the file at `to` appears only when it is whole.
Result<> copy_whole(const std::string& from, const std::filesystem::path& to) {
  const auto bytes = load_file(from, {.what = "picture", .max_bytes = 1U << 30});
  if (!bytes) return std::unexpected(bytes.error());
  return write_text(*bytes, to);
}

std::string frame_name(int frame) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06d.svg", frame);
  return name.data();
}

}  // namespace

Result<> write_picture(const std::string& svg, const std::filesystem::path& path) {
  if (clip::extension_of(path) == ".svg") return write_text(svg, path);
  const auto folder = TemporaryFolder::make();
  if (!folder) return std::unexpected(folder.error());
  const std::string drawing = (*folder)->file("picture.svg");
  const std::string pixels = (*folder)->file("picture.png");
  if (auto done = write_text(svg, drawing); !done) return done;
  const auto made =
      run_program({"rsvg-convert", "--format=png", "--output=" + pixels, drawing}, "librsvg2-bin");
  if (!made) return fail("a PNG " + made.error().message + "; or write an .svg", path.string());
  return copy_whole(pixels, path);
}

Result<> write_video(const Video& video, const std::filesystem::path& path) {
  const auto folder = TemporaryFolder::make();
  if (!folder) return std::unexpected(folder.error());
  for (int frame = 0; frame < video.frames; ++frame) {
    if (!video.progress(frame)) return fail("interrupted; nothing was written", path.string());
    const std::string name = (*folder)->file(frame_name(frame));
    if (auto done = write_text(video.draw(frame), name); !done) return done;
  }
  const std::string encoded = (*folder)->file("video.mp4");
  // H.264 with half as many colour samples, which every player shows, needs an even width and
  // height.
  const auto made =
      run_program({"ffmpeg", "-loglevel", "error", "-framerate", std::to_string(video.rate_hz),
                   "-i", (*folder)->file("%06d.svg"), "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                   "-c:v", "libx264", "-pix_fmt", "yuv420p", encoded},
                  "ffmpeg");
  if (!made) return fail("a video " + made.error().message, path.string());
  return copy_whole(encoded, path);
}

}  // namespace posed::picture
