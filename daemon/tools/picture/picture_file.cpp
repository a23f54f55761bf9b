#include "daemon/tools/picture/picture_file.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "proto/clip/format.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::picture {
namespace {

// The end of what the program wrote on its stderr, in one line.
std::string message(int descriptor) {
  constexpr std::size_t kKept = 400;
  std::string text;
  char part[4096];
  for (ssize_t count = 0; (count = ::read(descriptor, part, sizeof(part))) != 0;) {
    if (count < 0 && errno != EINTR) break;
    if (count > 0) text.append(part, static_cast<std::size_t>(count));
    if (text.size() > kKept) text.erase(0, text.size() - kKept);
  }
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t line = text.rfind('\n');
  return clean(line == std::string::npos ? text : text.substr(line + 1));
}

}  // namespace

Result<> run_program(const std::vector<std::string>& arguments, const std::string& package) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int said[2];
  if (::pipe2(said, O_CLOEXEC) != 0) return fail("cannot make a pipe: " + errno_text());
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, said[1], 2);
  pid_t child = -1;
  const int failed = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(said[1]);
  const std::string words = failed == 0 ? message(said[0]) : std::string();
  ::close(said[0]);
  if (failed == ENOENT) {
    return fail("needs the program " + arguments.front() +
                ", which is not installed: apt install " + package);
  }
  if (failed != 0) return fail("cannot start " + arguments.front() + ": " + errno_text(failed));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) return fail("interrupted");
  return fail(arguments.front() + " failed" + (words.empty() ? "" : ": " + words));
}

namespace {

// A folder for files that only the drawing programs read; it goes with the object.
class TemporaryFolder {
 public:
  static Result<std::unique_ptr<TemporaryFolder>> make() {
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

// So that the file at `to` appears only when it is whole.
Result<> copy_whole(const std::string& from, const std::filesystem::path& to) {
  const auto bytes = TRY(load_file(from, {.what = "picture", .max_bytes = 1U << 30}));
  return write_whole_file(to, bytes);
}

std::string frame_name(int frame) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06d.svg", frame);
  return name.data();
}

}  // namespace

Result<> write_picture(const std::string& svg, const std::filesystem::path& path) {
  if (clip::extension_of(path) == ".svg") return write_whole_file(path, svg);
  const auto folder = TRY(TemporaryFolder::make());
  const std::string drawing = folder->file("picture.svg");
  const std::string pixels = folder->file("picture.png");
  TRY(write_whole_file(drawing, svg));
  const auto made =
      run_program({"rsvg-convert", "--format=png", "--output=" + pixels, drawing}, "librsvg2-bin");
  if (!made) return fail("a PNG " + made.error().message + "; or write an .svg", path.string());
  return copy_whole(pixels, path);
}

Result<> write_video(const Video& video, const std::filesystem::path& path) {
  const auto folder = TRY(TemporaryFolder::make());
  for (int frame = 0; frame < video.frames; ++frame) {
    if (!video.progress(frame)) return fail("interrupted; nothing was written", path.string());
    const std::string name = folder->file(frame_name(frame));
    TRY(write_whole_file(name, video.draw(frame)));
  }
  const std::string encoded = folder->file("video" + path.extension().string());
  std::vector<std::string> call{"ffmpeg",
                                "-loglevel",
                                "error",
                                "-framerate",
                                std::to_string(video.rate_hz),
                                "-i",
                                folder->file("%06d.svg")};
  // H.264 with half as many colour samples, which every player shows, needs an even width and
  // height.
  static const std::vector<std::string> kMp4{
      "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-pix_fmt", "yuv420p"};
  static const std::vector<std::string> kWebp{"-c:v", "libwebp", "-loop", "0", "-quality", "60"};
  const std::vector<std::string>& codec = clip::extension_of(path) == ".webp" ? kWebp : kMp4;
  call.insert(call.end(), codec.begin(), codec.end());
  call.push_back(encoded);
  const auto made = run_program(call, "ffmpeg");
  if (!made) return fail("a video " + made.error().message, path.string());
  return copy_whole(encoded, path);
}

}  // namespace posed::picture
