#include "daemon/tools/demo/demo_folder.hpp"

#include <algorithm>
#include <cstdlib>
#include <ostream>
#include <span>

#include <nlohmann/json.hpp>

#include "daemon/tools/demo/demo_clips.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/profile_texts.hpp"
#include "proto/log/digest.hpp"
#include "proto/text/json_text.hpp"
#include "proto/text/load_file.hpp"

namespace posed {

std::span<const ProfileText> config_texts();  // config/*.toml, written by daemon/CMakeLists.txt

namespace tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kStamp = "demo.json";
constexpr std::uintmax_t kMaxStamp = 64 * 1024;      // bytes of the stamp file
constexpr std::uintmax_t kMaxBytes = 1'000'000'000;  // of the program, or of a file that it wrote

// Empty if the file cannot be read.
std::string digest_of(const fs::path& file) {
  const auto bytes = load_file(file, {.what = "file", .max_bytes = kMaxBytes});
  return bytes ? log::sha256_hex(std::as_bytes(std::span(*bytes))) : std::string();
}

// A hash of the whole program, because another build may train other models.
std::string program_digest() { return digest_of("/proc/self/exe"); }

json digests_of_files(const fs::path& folder) {
  json digests = json::object();
  for (const std::string& name : demo_file_names()) digests[name] = digest_of(folder / name);
  digests[kDemoConfig] = digest_of(folder / kDemoConfig);
  return digests;
}

Result<> write_stamp(const fs::path& folder, const json& stamp) {
  return clip::write_text(folder / kStamp,
                          [&](std::ostream& out) { out << json_text(stamp, 2) << "\n"; });
}

std::string config_text() {
  for (const ProfileText& text : config_texts()) {
    if (text.file != kDemoConfig) continue;
    std::string toml =
        "# `posed demo` writes this file, and again when it makes new models: copy it "
        "before you change it.\n" +
        std::string(text.toml);
    constexpr std::string_view kInSourceTree = "../build/demo/";
    for (auto at = toml.find(kInSourceTree); at != std::string::npos;
         at = toml.find(kInSourceTree)) {
      toml.erase(at, kInSourceTree.size());
    }
    return toml;
  }
  return {};
}

}  // namespace

Result<fs::path> demo_cache_folder() {
  const auto absolute = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    const fs::path path = value == nullptr ? fs::path() : fs::path(value);
    return path.is_absolute() ? path : fs::path();
  };
  fs::path cache = absolute("XDG_CACHE_HOME");
  if (cache.empty() && !absolute("HOME").empty()) cache = absolute("HOME") / ".cache";
  if (cache.empty()) {
    return misuse("neither XDG_CACHE_HOME nor HOME names a folder; give --folder DIR");
  }
  return cache / "posed" / "demo";
}

bool DemoFolder::is_up_to_date() const {
  const auto text = load_file(path_ / kStamp, {.what = "stamp", .max_bytes = kMaxStamp});
  if (!text) return false;
  const json stamp = json::parse(*text, nullptr, false);
  if (!stamp.is_object() || !stamp.contains("files") || !stamp["files"].is_object()) return false;
  if (stamp.value("program", "") != program_digest()) return false;
  return std::ranges::all_of(stamp["files"].items(), [&](const auto& file) {
    return file.value().is_string() &&
           digest_of(path_ / file.key()) == file.value().template get<std::string>();
  });
}

Result<> DemoFolder::check_is_own(const std::vector<std::string>& names, bool overwrite) const {
  std::error_code error;
  if (overwrite || fs::exists(path_ / kStamp, error)) return {};
  // of a version of the demo that wrote no stamp
  if (fs::exists(path_ / kDemoModel, error)) return {};
  for (const std::string& name : names) {
    if (!fs::exists(path_ / name, error)) continue;
    return misuse("exists already, and no demo wrote it; name another folder, or add --overwrite",
                  (path_ / name).string());
  }
  return {};
}

Result<> DemoFolder::begin() const {
  std::error_code error;
  fs::create_directories(path_, error);  // writing says what failed
  return write_stamp(path_, json::object());
}

Result<> DemoFolder::finish() const {
  const std::string config = config_text();
  auto written = clip::write_text(path_ / kDemoConfig, [&](std::ostream& out) { out << config; });
  if (!written) return written;
  return write_stamp(path_, {{"program", program_digest()}, {"files", digests_of_files(path_)}});
}

}  // namespace tools
}  // namespace posed
