#include "daemon/control/recording_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "models/motion/vrm_animation.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kMaxRecordings = 256;
// Of a clip that is converted, so that it takes less than a second and 64 MB: bytes, before and
// after, and values, of which a byte or ten may make one.
constexpr std::size_t kMaxConverted = 12UL * 1024 * 1024;
constexpr std::ptrdiff_t kMaxConvertedValues = 1'500'000;

std::ptrdiff_t words_in(std::string_view text) {
  std::ptrdiff_t words = 0;
  bool blank = true;
  for (const char c : text) {
    const bool was_blank = std::exchange(blank, c == ' ' || c == '\t' || c == '\n' || c == '\r');
    if (was_blank && !blank) ++words;
  }
  return words;
}

// A name in the folder; control characters in it would reach people's terminals.
bool is_recording(const std::string& name) {
  const std::filesystem::path file(name);
  return (file.extension() == ".plog" || file.extension() == ".bvh") && file.filename() == file &&
         name.front() != '.' && clean(name) == name;
}

// A log that is being written has another file beside it.
bool is_in_use(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::exists(file.string() + "-wal", ignored);
}

Error no_folder() {
  return fail(
             "the daemon shows no recordings: name their folder in its config ([control]"
             " recordings = \"takes\") and start again")
      .error();
}

// -1 with errno; links are not followed, and what is no file is not opened.
int open_recording(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct stat about{};
  if (file < 0 || (fstat(file, &about) == 0 && S_ISREG(about.st_mode))) return file;
  close(file);
  errno = ENOENT;
  return -1;
}

}  // namespace

Result<std::vector<FolderRecording>> RecordingFolder::list() const {
  if (folder_.empty()) return std::unexpected(no_folder());
  std::vector<FolderRecording> files;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder_, error);
  if (error == std::errc::no_such_file_or_directory) return files;
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    struct stat about{};
    // Links are not followed.
    if (!is_recording(name) || lstat(entries->path().c_str(), &about) != 0 ||
        !S_ISREG(about.st_mode)) {
      continue;
    }
    files.push_back({.name = name,
                     .bytes = static_cast<std::uint64_t>(about.st_size),
                     .changed_unix_s = about.st_mtim.tv_sec,
                     .in_use = is_in_use(entries->path())});
  }
  if (error) {
    return fail("the folder of recordings cannot be read: " + error.message(), folder_.string());
  }
  std::ranges::sort(files, [](const FolderRecording& a, const FolderRecording& b) {
    return std::pair(b.changed_unix_s, b.name) < std::pair(a.changed_unix_s, a.name);
  });
  if (files.size() > kMaxRecordings) files.resize(kMaxRecordings);
  return files;
}

// Without the list: a folder of many files would be read for every piece of one.
Result<std::string> RecordingFolder::piece(std::string_view name, std::uint64_t offset) const {
  if (folder_.empty()) return std::unexpected(no_folder());
  const std::string wanted(name);
  const auto path = folder_ / wanted;
  // Before it is opened: to close a file ends this process's locks on it, SQLite's of the log that
  // it writes, too, and then others who read that log may take its -wal file away.
  if (is_recording(wanted) && (is_in_use(path) || is_written_here(path))) {
    return fail(
        fmt::format("{} is still being written; it can be fetched when posed has ended, or"
                    " once `posed convert` has opened it if posed was killed",
                    in_quotes(name)));
  }
  const int file = is_recording(wanted) ? open_recording(path) : -1;
  if (file < 0 && (!is_recording(wanted) || errno == ENOENT || errno == ELOOP)) {
    return fail(fmt::format("there is no recording {} in the daemon's list", in_quotes(name)));
  }
  if (file < 0) return fail("the recording cannot be read: " + errno_text(), wanted);
  constexpr std::uint64_t kFarthest = std::numeric_limits<off_t>::max() / 2;  // past any end
  offset = std::min(offset, kFarthest);
  std::string bytes(kMaxRecordingPiece, '\0');
  const ssize_t size = pread(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
  const std::string why = size < 0 ? errno_text() : "";
  close(file);
  if (size < 0) return fail("the recording cannot be read: " + why, wanted);
  bytes.resize(static_cast<std::size_t>(size));
  return bytes;
}

Result<std::string> RecordingFolder::converted(const Part& part) const {
  if (part.as != "glb" && part.as != "vrma") {
    return fail("a clip is had as glb or vrma, not as " + in_quotes(part.as));
  }
  if (!std::isfinite(part.from_s) || !std::isfinite(part.to_s)) {
    return fail("from and to are seconds");
  }
  if (!part.name.ends_with(".bvh")) {
    return fail(in_quotes(part.name) + " is no BVH, which alone becomes another kind of file");
  }
  clip::ClipFile file{.name = part.name, .bytes = {}};
  for (;;) {
    const std::string more = TRY(piece(part.name, file.bytes.size()));
    if (more.empty()) break;
    file.bytes += more;
    if (file.bytes.size() > kMaxConverted) break;
  }
  if (file.bytes.size() > kMaxConverted || words_in(file.bytes) > kMaxConvertedValues) {
    return fail(part.name +
                " is too long for this; `posed convert` on the daemon's computer does it");
  }
  clip::Clip clip = TRY(clip::parse_clip(std::move(file)));
  const auto frame_at = [&](double at_s) {
    const double frame = std::round(at_s * clip.frame_rate_hz);
    return static_cast<int>(std::clamp(frame, 0.0, static_cast<double>(clip.frames())));
  };
  const int first = frame_at(part.from_s);
  const int end = part.to_s > 0.0 ? frame_at(part.to_s) : clip.frames();
  if (!(end > first)) return fail("there are no frames from here to there in " + part.name);
  clip::keep_frames(clip, first, end);
  std::string own = (folder_ / ".posed-XXXXXX").string();  // nobody else's file can be in there
  if (mkdtemp(own.data()) == nullptr) {
    return fail("nothing can be written into the folder of recordings: " + errno_text());
  }
  const auto made = std::filesystem::path(own) / ("clip." + part.as);
  const auto written =
      part.as == "glb" ? clip::write_glb(clip, made) : motion::write_vrm_animation(clip, made);
  auto bytes = written ? load_file(made, {.what = "clip", .max_bytes = kMaxConverted})
                       : Result<std::string>(std::unexpected(written.error()));
  std::error_code ignored;
  std::filesystem::remove_all(own, ignored);
  return bytes;
}

}  // namespace posed::control
