#include "daemon/config/config.hpp"

#include <algorithm>
#include <array>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/toml_reader.hpp"
#include "daemon/net/keys.hpp"
#include "models/stages/registry.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/nearest_word.hpp"
#include "proto/text/toml.hpp"

namespace posed::config {
namespace {

using config::DaemonConfig;
using config::SecurityConfig;
using config::StreamConfig;

constexpr Range kStaleAfter{0.01, 3600.0};
constexpr std::array<std::string_view, 3> kIdentityKeys{"port", "id", "hand"};
constexpr std::string_view kRawSuffix = "-raw";
constexpr TomlLimits kLimits{
    .what = "config", .bytes = std::size_t{1024} * 1024, .depth = 8, .items = 16384};
constexpr std::size_t kMaxStreams = 64;
constexpr std::size_t kMaxClients = 1024;

// Reads the tables of the file. A class, because all of its functions need the file's folder and
// name.
class Reader {
 public:
  Reader(std::filesystem::path folder, Drivers drivers, Findings& findings)
      : folder_(std::move(folder)), drivers_(drivers), findings_(findings) {}

  void read(const toml::table& root, DaemonConfig& config);

 private:
  void read_endpoint(TableReader& root, const char* table, std::string& endpoint, bool& insecure,
                     bool secured);
  void read_security(TableReader table, SecurityConfig& security);
  void read_client(TableReader table, std::vector<net::AllowedClient>& clients);
  void read_stream(TableReader table, StreamConfig& stream);
  void read_options(TableReader& stream_table, const drivers::Driver& driver,
                    drivers::Options& options);
  // A driver's option or a stage's parameter.
  void read_parameter(TableReader& table, const ParameterSpec& spec, ParameterValue& value);
  void read_stages(TableReader& table, StreamConfig& stream);
  // Returns false if the table switches the stage off.
  [[nodiscard]] bool read_stage(TableReader& table, StageConfig& stage);
  [[nodiscard]] std::vector<const StageType*> read_order(TableReader& table);
  void check_names(const std::vector<StreamConfig>& streams, const std::vector<int>& lines);

  [[nodiscard]] std::filesystem::path resolve(const std::string& path) const {
    return path.empty() ? std::filesystem::path{} : folder_ / path;
  }

  std::filesystem::path folder_;
  Drivers drivers_;
  Findings& findings_;
};

void Reader::read(const toml::table& root_table, DaemonConfig& config) {
  TableReader root(root_table, "", findings_);
  root.read("realtime", config.realtime);
  if (auto table = root.table("security")) read_security(*table, config.security);
  const bool secured = !config.security.server_key.empty();
  read_endpoint(root, "publish", config.publish_endpoint, config.publish_insecure, secured);
  read_endpoint(root, "control", config.control_endpoint, config.control_insecure, secured);
  if (config.publish_endpoint == config.control_endpoint &&
      !config.publish_endpoint.ends_with(":*")) {
    root.add_error("control", "publish and control cannot share the endpoint " +
                                  config.control_endpoint + "; give control another port");
  }
  std::vector<int> lines;
  for (TableReader& table : root.tables("stream", kMaxStreams)) {
    lines.push_back(table.line());
    read_stream(table, config.streams.emplace_back());
  }
  if (!root_table.contains("stream")) {
    findings_.add_error(0, "there is no stream; add a [[stream]] table with a name and a driver");
  }
  check_names(config.streams, lines);
  root.finish();
}

void Reader::read_endpoint(TableReader& root, const char* name, std::string& endpoint,
                           bool& insecure, bool secured) {
  auto table = root.table(name);
  if (!table) return;
  table->read("endpoint", endpoint);
  table->read("insecure", insecure);
  table->finish();
  if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://")) {
    table->add_error("endpoint",
                     fmt::format("{} is not an endpoint; it looks like tcp://127.0.0.1:5570,"
                                 " or ipc:///run/posed.sock",
                                 in_quotes(endpoint)));
  } else if (!net::is_loopback(endpoint) && !secured && !insecure) {
    table->add_error(
        "endpoint",
        fmt::format("{} can be reached from other machines by anyone; add a server_key in"
                    " [security], or say insecure = true in [{}]",
                    clean_name(endpoint), name));
  }
}

void Reader::read_security(TableReader table, SecurityConfig& security) {
  std::string key_file;
  table.read("server_key", key_file);
  security.server_key = resolve(key_file);
  if (!key_file.empty()) {
    if (auto key = net::read_secret_key(security.server_key); !key) {
      table.add_error("server_key", key.error().text());
    }
  }
  for (TableReader& client : table.tables("client", kMaxClients))
    read_client(client, security.clients);
  if (key_file.empty() && !security.clients.empty()) {
    table.add_error("client",
                    "clients are listed but there is no server_key, so anyone could connect;"
                    " make one with `posed keygen server` and name server.key here");
  }
  table.finish();
}

void Reader::read_client(TableReader table, std::vector<net::AllowedClient>& clients) {
  net::AllowedClient client;
  std::string key;
  std::vector<std::string> rights{"subscribe"};
  table.require("name", client.name);
  table.require("public_key", key);
  table.read("rights", rights);
  table.finish();
  client.may_subscribe = std::ranges::find(rights, "subscribe") != rights.end();
  client.may_control = std::ranges::find(rights, "control") != rights.end();
  for (const std::string& right : rights) {
    if (right == "subscribe" || right == "control") continue;
    table.add_error("rights", "there are two rights, \"subscribe\" and \"control\"");
  }
  if (net::is_key(key)) {
    client.public_z85 = key;
  } else if (!key.empty()) {
    auto read = net::read_public_key(resolve(key));
    if (read) client.public_z85 = *read;
    if (!read) table.add_error("public_key", read.error().text());
  }
  for (const net::AllowedClient& other : clients) {
    if (other.name == client.name) {
      table.add_error("name", fmt::format("two clients are named {}", in_quotes(client.name)));
    } else if (other.public_z85 == client.public_z85 && !client.public_z85.empty()) {
      table.add_error(
          "public_key",
          fmt::format("{} and {} have the same key; make each its own with `posed keygen`",
                      in_quotes(other.name), in_quotes(client.name)));
    }
  }
  clients.push_back(std::move(client));
}

void Reader::read_stream(TableReader table, StreamConfig& stream) {
  table.require("name", stream.name);
  table.require("driver", stream.driver);
  table.read("publish_raw", stream.publish_raw);
  table.read("stale_after_s", stream.stale_after_s, kStaleAfter);
  std::string calibration;
  table.read("calibration", calibration);
  stream.calibration = resolve(calibration);
  read_stages(table, stream);
  if (!stream.name.empty() && !is_stream_name(stream.name)) {
    table.add_error("name", "a stream's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  }
  const auto driver = std::ranges::find(drivers_, stream.driver, &drivers::Driver::name);
  if (driver != drivers_.end()) {
    read_options(table, *driver, stream.options);
    if (driver->make_layout != nullptr) {
      table.add_error("driver", fmt::format("{} delivers several bodies, which this posed cannot"
                                            " stream yet; one stream takes a device with one body",
                                            driver->name));
    }
  } else if (!stream.driver.empty()) {
    std::set<std::string> names;
    for (const drivers::Driver& known : drivers_) names.emplace(known.name);
    const std::string near = nearest(stream.driver, names);
    table.add_error("driver", fmt::format("there is no driver of this name; {}",
                                          near.empty() ? "`posed devices` lists them"
                                                       : "the nearest is '" + near +
                                                             "' (`posed devices` lists them)"));
    // Looks up every driver table, so that none is reported as unknown beside this error.
    for (const std::string& name : names) (void)table.table(name);
  }
  table.finish();
}

void Reader::read_options(TableReader& stream_table, const drivers::Driver& driver,
                          drivers::Options& options) {
  const std::string name(driver.name);
  auto table = stream_table.table(name);
  for (const drivers::OptionSpec& spec : driver.options) {
    const std::string key(spec.name);
    drivers::OptionValue value = spec.default_value;
    // Keys that say which device it is stand beside the driver's name; keys that say how it is used
    // stand in the driver's own table.
    const bool beside = driver.expect != nullptr &&
                        std::ranges::find(kIdentityKeys, spec.name) != kIdentityKeys.end();
    if (beside) read_parameter(stream_table, spec, value);
    if (!beside && table) read_parameter(*table, spec, value);
    if (spec.required && !(beside ? stream_table.has(key) : table && table->has(key))) {
      findings_.add_error(table ? table->line() : stream_table.line(),
                          fmt::format("stream.{}.{} is missing: {}", name, key, spec.help));
    }
    options[key] = std::move(value);
  }
  if (table) table->finish();
}

void Reader::read_parameter(TableReader& table, const ParameterSpec& spec, ParameterValue& value) {
  table.read(spec, value);
  auto* text = std::get_if<std::string>(&value);
  if (spec.is_path && text != nullptr) *text = resolve(*text).string();
}

// The stages of a stream: one for each of their tables, in the order of the registry or in that of
// `stages = [...]`.
void Reader::read_stages(TableReader& table, StreamConfig& stream) {
  std::map<const StageType*, StageConfig> present;
  for (const StageType* type : stage_types()) {
    auto stage_table = table.table(std::string(type->name));
    if (!stage_table) continue;
    StageConfig stage{.type = type};
    if (read_stage(*stage_table, stage)) {
      present.emplace(type, std::move(stage));
    } else {
      stream.off.push_back(type);
    }
  }
  stream.default_stages = !table.has("stages");
  const std::size_t errors = findings_.errors.size();
  std::vector<const StageType*> order = read_order(table);
  if (findings_.errors.size() > errors) return;
  if (stream.default_stages) order.assign(stage_types().begin(), stage_types().end());
  for (const StageType* type : order) {
    auto found = present.extract(type);
    if (!found.empty()) {
      stream.stages.push_back(std::move(found.mapped()));
    } else if (!stream.default_stages && std::ranges::find(stream.off, type) == stream.off.end()) {
      auto parameters = complete_parameters(type->parameters, {});
      if (type->model_required) {
        table.add_error("stages", fmt::format("stage {0} needs a model; add a [stream.{0}] table"
                                              " with model = \"FILE\"",
                                              type->name));
      } else if (!parameters) {
        table.add_error("stages", fmt::format("stage {0} needs a [stream.{0}] table: {1}",
                                              type->name, parameters.error().message));
      } else {
        stream.stages.push_back({.type = type, .parameters = std::move(*parameters)});
      }
    }
  }
  for (const StageType* type : stage_types()) {
    if (!present.contains(type)) continue;
    table.add_error("stages", fmt::format("[stream.{0}] is there, but {0} is not in this list; add"
                                          " it, or leave out its table",
                                          type->name));
  }
}

std::vector<const StageType*> Reader::read_order(TableReader& table) {
  std::vector<std::string> names;
  table.read("stages", names);
  std::vector<const StageType*> order;
  for (const std::string& name : names) {
    const StageType* type = find_stage_type(name);
    if (type == nullptr) {
      std::string known;
      for (const StageType* one : stage_types()) {
        known += (known.empty() ? "" : ", ") + std::string(one->name);
      }
      table.add_error("stages",
                      fmt::format("there is no stage {}; there is: {}", in_quotes(name), known));
    } else if (std::ranges::find(order, type) != order.end()) {
      table.add_error("stages",
                      fmt::format("{} is in the list twice; a stream has each stage once", name));
    } else {
      order.push_back(type);
    }
  }
  return order;
}

bool Reader::read_stage(TableReader& table, StageConfig& stage) {
  const StageType& type = *stage.type;
  bool enabled = true;
  table.read("enabled", enabled);
  std::string model;
  if (type.model_required && enabled) {
    table.require("model", model);
  } else if (type.has_model()) {
    table.read("model", model);
  }
  stage.model = resolve(model);
  for (const ParameterSpec& spec : type.parameters) {
    ParameterValue value = spec.default_value;
    read_parameter(table, spec, value);
    if (spec.required && enabled && !table.has(spec.shown_name())) {
      table.add_error(spec.shown_name(), fmt::format("stream.{}.{} is missing: {}", type.name,
                                                     spec.shown_name(), spec.help));
    }
    stage.parameters.emplace(spec.name, std::move(value));
  }
  if (type.check != nullptr && enabled) {
    const auto fault = type.check(stage.parameters, !model.empty());
    if (fault) table.add_error(fault->parameter, fault->sentence);
  }
  table.finish();
  return enabled;
}

void Reader::check_names(const std::vector<StreamConfig>& streams, const std::vector<int>& lines) {
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::string raw = streams[i].name + std::string(kRawSuffix);
    if (streams[i].publish_raw && is_stream_name(streams[i].name) && !is_stream_name(raw)) {
      findings_.add_error(lines[i], fmt::format("{} is longer than 32 letters; shorten the name or"
                                                " leave out publish_raw",
                                                in_quotes(raw)));
    }
    for (std::size_t j = 0; j < streams.size(); ++j) {
      if (j < i && streams[j].name == streams[i].name && !streams[i].name.empty()) {
        findings_.add_error(lines[i], fmt::format("a second stream is named {} (the first stands in"
                                                  " line {}); every stream has its own name",
                                                  in_quotes(streams[i].name), lines[j]));
      }
      if (streams[i].publish_raw && streams[j].name == raw) {
        findings_.add_error(lines[j], fmt::format("{} is the name under which the raw input of {}"
                                                  " is published; choose another",
                                                  in_quotes(raw), in_quotes(streams[i].name)));
      }
    }
  }
}

// Every key that a config may have, found by reading a config that has every table.
std::set<std::string> all_keys(Drivers drivers) {
  std::string text = "[publish]\n[control]\n[security]\n[[security.client]]\n";
  for (const drivers::Driver& driver : drivers) {
    text += fmt::format("[[stream]]\ndriver = \"{0}\"\n[stream.{0}]\n", driver.name);
    for (const StageType* stage : stage_types()) text += fmt::format("[stream.{}]\n", stage->name);
  }
  Findings findings{.file = {}, .errors = {}, .known = {}, .all_keys = {}};
  DaemonConfig ignored;
  if (const auto root = parse_toml(text, {}, kLimits)) {
    Reader({}, drivers, findings).read(*root, ignored);
  }
  return std::move(findings.known);
}

}  // namespace

bool is_stream_name(std::string_view name) {
  return !name.empty() && name.size() <= 32 &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string_view::npos;
}

Reading read_config(const std::string& text, const std::filesystem::path& path, Drivers drivers) {
  Reading reading;
  Findings findings{
      .file = path.string(), .errors = {}, .known = {}, .all_keys = all_keys(drivers)};
  reading.config.text = text;
  const auto root = parse_toml(text, path.string(), kLimits);
  if (root) {
    Reader(path.parent_path(), drivers, findings).read(*root, reading.config);
  } else {
    findings.add_error(root.error().line, root.error().message);
  }
  reading.errors = std::move(findings.errors);
  reading.known = std::move(findings.known);
  std::ranges::stable_sort(reading.errors, {}, &Error::line);
  return reading;
}

Reading read_config_file(const std::filesystem::path& path, Drivers drivers) {
  const auto text = load_file(path, {.what = kLimits.what, .max_bytes = kLimits.bytes});
  if (text) return read_config(*text, path, drivers);
  Reading reading;
  reading.errors.push_back(text.error());
  reading.errors.back().exit_code = ExitCode::kWrongUse;
  return reading;
}

Result<config::DaemonConfig> load_config(const std::filesystem::path& path, Drivers drivers) {
  Reading reading = read_config_file(path, drivers);
  if (!reading.errors.empty()) return std::unexpected(reading.errors.front());
  return std::move(reading.config);
}

}  // namespace posed::config
