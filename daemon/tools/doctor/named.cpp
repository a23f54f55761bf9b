// The checks of what a config names: disk, ports, keys, models, logs.
#include <sys/stat.h>

#include <algorithm>
#include <span>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/take_tables.hpp"
#include "daemon/tools/doctor/doctor.hpp"
#include "daemon/tools/doctor/wanted.hpp"
#include "proto/log/reader.hpp"
#include "proto/model/model_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::doctor {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastRecording_h = 1.0;

// The folder itself, or the first one above it that exists.
fs::path existing(fs::path folder) {
  std::error_code failed;
  folder = fs::absolute(folder, failed);
  while (!fs::is_directory(folder, failed) && folder.has_relative_path()) {
    folder = folder.parent_path();
  }
  return folder;
}

std::string shown(const fs::path& path) { return clean(path.string()); }

// The secret keys that a config names.
std::vector<fs::path> key_files(const config::DaemonConfig& config) {
  std::vector<fs::path> files;
  if (!config.security.server_key.empty()) files.push_back(config.security.server_key);
  const auto add = [&](const drivers::Options& options) {
    if (const std::string key = config::text_option(options, "key"); !key.empty())
      files.emplace_back(key);
  };
  for (const config::StreamConfig& stream : config.streams) add(stream.options);
  for (const config::SourceConfig& source : config.sources) add(source.options);
  return files;
}

void add_models(const config::StreamConfig& stream, std::vector<fs::path>& files) {
  for (const config::StageConfig& stage : stream.stages) {
    if (!stage.model.empty()) files.push_back(stage.model);
  }
}

std::vector<fs::path> model_files(const config::DaemonConfig& config) {
  std::vector<fs::path> files;
  for (const config::StreamConfig& stream : config.streams) add_models(stream, files);
  for (const config::SourceConfig& source : config.sources) {
    for (const auto& named : source.named) add_models(named.stream, files);
    add_models(source.every, files);
  }
  std::ranges::sort(files);
  files.erase(std::ranges::unique(files).begin(), files.end());
  return files;
}

Result<> try_model(const fs::path& path) {
  const auto bytes = model_file::load(path);
  if (!bytes) return std::unexpected(bytes.error());
  const auto opened = model_file::open(std::as_bytes(std::span(*bytes)), path.string());
  if (!opened) return std::unexpected(opened.error());
  return {};
}

}  // namespace

Check check_disk(const Machine& machine, Config config) {
  const std::string name = "disk";
  if (config == nullptr) return needs_config(name);
  if (!config->record) return right(name, "not needed: the config has no [record]");
  const fs::path folder = existing(config->record->folder);
  if (!machine.may_write(folder)) {
    return wrong(name, "no permission to write to " + shown(folder),
                 "sudo chown " + machine.user + " " + shown(folder));
  }
  if (const auto fine = config::check_folder(*config->record); !fine) {
    return wrong(name, fine.error().text(), "set [record] folder to one where files can be made");
  }
  const auto free = machine.free_bytes(folder);
  if (!free) return right(name, "the free space of " + shown(folder) + " cannot be told");
  const double rate = recorded_bytes_per_s(*config);
  const double hours = rate > 0.0 ? static_cast<double>(*free) / rate / 3600.0 : 1e9;
  const std::string found =
      fmt::format("{:.1f} GB free in {}, for about {:.1f} hours at {:.0f} KB a second",
                  static_cast<double>(*free) / 1e9, shown(folder), hours, rate / 1e3);
  if (hours >= kLeastRecording_h) return right(name, found);
  return wrong(name, found, "free some space, or set [record] folder to a larger disk");
}

Check check_ports(const Machine& machine, Config config) {
  const std::string name = "ports";
  if (config == nullptr) return needs_config(name);
  std::string bad;
  const auto listeners = listeners_of(*config);
  for (const Listener& listener : listeners) {
    const auto bound = machine.try_bind(listener);
    if (bound) continue;
    bad += (bad.empty() ? "" : "; ") + listener.who + ": " + (listener.udp ? "udp " : "tcp ") +
           clean_name(listener.endpoint) + " cannot be bound (" + bound.error().message + ")";
  }
  if (bad.empty()) return right(name, std::to_string(listeners.size()) + " can be bound");
  return wrong(name, bad,
               "see who has it with `sudo ss -tulpn`: perhaps posed runs already (`posed ctl"
               " status`); end that, or choose another port in the config");
}

Check check_keys(Config config) {
  const std::string name = "keys";
  if (config == nullptr) return needs_config(name);
  const auto files = key_files(*config);
  if (files.empty()) return right(name, "not needed: the config names no secret key");
  for (const fs::path& file : files) {
    struct stat info{};
    if (::stat(file.c_str(), &info) == 0 && (info.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
      return wrong(name, shown(file) + " can be read by other users", "chmod 600 " + shown(file));
    }
    if (const auto pair = net::read_secret_key(file); !pair) {
      return wrong(name, pair.error().text(),
                   "posed keygen " + shown(file.stem()) + " --out " +
                       shown(file.has_parent_path() ? file.parent_path() : "."));
    }
  }
  return right(name, std::to_string(files.size()) + " that only their owner reads");
}

Check check_models(Config config) {
  const std::string name = "models";
  if (config == nullptr) return needs_config(name);
  const auto files = model_files(*config);
  if (files.empty()) return right(name, "not needed: the config names no model");
  for (const fs::path& file : files) {
    if (const auto opened = try_model(file); !opened) {
      return wrong(name, opened.error().text(),
                   "give the right path, or train it with this version (`posed train --help`)");
    }
  }
  return right(name, std::to_string(files.size()) + " that this version reads");
}

Check check_logs(Config config) {
  const std::string name = "logs";
  if (config == nullptr) return needs_config(name);
  if (!config->record) return right(name, "not needed: the config has no [record]");
  int count = 0;
  std::error_code failed;
  for (fs::directory_iterator entry(config->record->folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    if (entry->path().extension() != ".plog") continue;
    if (const auto readable = log::check_format(entry->path()); !readable) {
      return wrong(name, readable.error().text(),
                   "move it out of " + shown(config->record->folder) + ", or update posed");
    }
    ++count;
  }
  return right(name, count == 0 ? "none in " + shown(config->record->folder) + " yet"
                                : std::to_string(count) + " that this version reads");
}

}  // namespace posed::doctor
