#include "daemon/control/recording_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kMaxRecordings = 256;

bool is_recording(const std::filesystem::path& file) {
  return file.extension() == ".plog" || file.extension() == ".bvh";
}

}  // namespace

Result<std::vector<FolderRecording>> RecordingFolder::list() const {
  if (folder_.empty()) {
    return fail(
        "the daemon shows no recordings: name their folder in its config ([control] recordings ="
        " \"takes\") and start again");
  }
  std::vector<FolderRecording> files;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder_, error);
  if (error == std::errc::no_such_file_or_directory) return files;
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    struct stat about{};
    // Links are not followed; control characters in a name would reach people's terminals.
    if (!is_recording(name) || name.front() == '.' || clean(name) != name ||
        lstat(entries->path().c_str(), &about) != 0 || !S_ISREG(about.st_mode)) {
      continue;
    }
    std::error_code ignored;
    files.push_back(
        {.name = name,
         .bytes = static_cast<std::uint64_t>(about.st_size),
         .changed_unix_s = about.st_mtim.tv_sec,
         .in_use = std::filesystem::exists(entries->path().string() + "-wal", ignored)});
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

Result<std::string> RecordingFolder::piece(std::string_view name, std::uint64_t offset) const {
  const auto files = TRY(list());
  const auto found = std::ranges::find(files, name, &FolderRecording::name);
  if (found == files.end()) {
    return fail(fmt::format("there is no recording {} in the daemon's list", in_quotes(name)));
  }
  if (found->in_use) {
    return fail(fmt::format("{} is still being written; it can be fetched when posed has ended",
                            in_quotes(name)));
  }
  if (offset > std::uint64_t{std::numeric_limits<off_t>::max()}) return std::string();
  const auto path = folder_ / found->name;
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return fail("the recording cannot be read: " + errno_text(), found->name);
  std::string bytes(kMaxRecordingPiece, '\0');
  const ssize_t size = pread(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
  const std::string why = size < 0 ? errno_text() : "";
  close(file);
  if (size < 0) return fail("the recording cannot be read: " + why, found->name);
  bytes.resize(static_cast<std::size_t>(size));
  return bytes;
}

}  // namespace posed::control
