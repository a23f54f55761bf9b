#include "daemon/config/take_tables.hpp"

#include <stdlib.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/transport/address.hpp"
#include "proto/text/clean.hpp"

namespace posed::config {
namespace {

constexpr std::array<std::string_view, 2> kClipWords{"none", "bvh"};

}  // namespace

void read_record(TableReader& root, const ConfigFile& file, DaemonConfig& config) {
  auto table = root.table("record");
  if (!table) return;
  RecordConfig& record = config.record.emplace();
  std::string folder = record.folder.string();
  table->read("folder", folder);
  record.line = table->line_of("folder");
  if (folder.empty()) table->add_error("folder", "name a folder, like folder = \"takes\"");
  record.folder = file.resolve(folder);
  table->read("frames", record.frames);
  record.clips = table->choice("clips", kClipWords) == 1;
  table->finish();
}

void read_trigger(TableReader& root, DaemonConfig& config) {
  auto table = root.table("trigger");
  if (!table) return;
  TriggerConfig& trigger = config.trigger.emplace();
  table->read("listen", trigger.listen);
  table->read("peers", trigger.peers);
  table->finish();
  for (const std::string& peer : trigger.peers) {
    if (const auto host = drivers::parse_host(peer); !host) {
      table->add_error("peers", host.error().message);
    }
  }
  const auto address = drivers::listen_address(trigger.listen, trigger.peers, "the senders'");
  if (!address) table->add_error("listen", address.error().message);
}

Result<> check_folder(const RecordConfig& record) {
  std::error_code ignored;
  std::error_code failed;
  std::filesystem::path there = std::filesystem::absolute(record.folder, ignored);
  while (there.has_relative_path() && !std::filesystem::exists(there, failed)) {
    if (failed) break;  // links in a circle, too long a name, a folder one may not enter
    there = there.parent_path();
  }
  const std::string shown = clean(there.string());
  if (failed) {
    return fail(shown + " cannot be reached (" + failed.message() +
                "), where recordings would go; name another [record] folder");
  }
  if (!std::filesystem::is_directory(there, ignored)) {
    return fail(shown +
                " is a file, so it cannot be a folder for recordings; name another"
                " [record] folder");
  }
  // Only the attempt tells: root may write into /proc, where nothing can be made.
  std::string attempt = (there / ".posed-XXXXXX").string();
  if (::mkdtemp(attempt.data()) == nullptr) {
    return fail("nothing can be made in " + shown + " (" + errno_text() +
                "), where recordings"
                " would go; name another [record] folder");
  }
  std::filesystem::remove(attempt, ignored);
  return {};
}

}  // namespace posed::config
