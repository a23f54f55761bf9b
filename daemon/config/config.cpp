#include "daemon/config/config.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config_file.hpp"
#include "daemon/config/listeners.hpp"
#include "daemon/config/take_tables.hpp"
#include "drivers/transport/address.hpp"
#include "models/stages/registry.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/stream_name.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"
#include "proto/zmq/keys.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::config {
namespace {

using config::DaemonConfig;
using config::SecurityConfig;

constexpr TomlLimits kLimits{
    .what = "config", .bytes = std::size_t{1024} * 1024, .depth = 8, .items = 16384};
constexpr std::size_t kMaxClients = 1024;

void read_endpoint(TableReader& table, const char* name, std::string& endpoint, bool& insecure,
                   bool secured) {
  table.read("endpoint", endpoint);
  table.read("insecure", insecure);
  if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://")) {
    table.add_error("endpoint",
                    fmt::format("{} is not an endpoint; it looks like tcp://127.0.0.1:5570,"
                                " or ipc:///run/posed.sock",
                                in_quotes(endpoint)));
  } else if (const auto possible = net::check_endpoint(endpoint); !possible) {
    table.add_error("endpoint", possible.error().message);
  } else if (!net::is_loopback(endpoint) && !secured && !insecure) {
    table.add_error(
        "endpoint",
        fmt::format("{}; add a server_key in [security], or say insecure = true in [{}]",
                    net::open_to_anyone(endpoint), name));
  }
}

void read_publish(TableReader table, bool secured, DaemonConfig& config) {
  read_endpoint(table, "publish", config.publish_endpoint, config.publish_insecure, secured);
  table.finish();
}

void read_control(TableReader table, const ConfigFile& file, bool secured, DaemonConfig& config) {
  read_endpoint(table, "control", config.control_endpoint, config.control_insecure, secured);
  std::string models;
  table.read("models", models);
  if (!models.empty()) config.models = file.resolve(models);
  std::string recordings;
  table.read("recordings", recordings);
  if (!recordings.empty()) config.recordings = file.resolve(recordings);
  table.finish();
}

// Prometheus knows no keys, so other machines never reach this port itself.
void read_metrics(TableReader& root, DaemonConfig& config) {
  auto table = root.table("metrics");
  if (!table) return;
  MetricsConfig& metrics = config.metrics.emplace();
  table->read("listen", metrics.listen);
  table->finish();
  const auto address = drivers::parse_endpoint(metrics.listen);
  if (!address) {
    table->add_error("listen", address.error().message);
  } else if (!drivers::is_loopback(drivers::host_of(*address))) {
    table->add_error("listen",
                     fmt::format("{} can be reached by other machines, and metrics have no keys;"
                                 " listen on 127.0.0.1, and let a reverse proxy with TLS and a"
                                 " password pass them on",
                                 in_quotes(metrics.listen)));
  }
}

void read_client(TableReader table, const ConfigFile& file,
                 std::vector<net::AllowedClient>& clients) {
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
    auto read = net::read_public_key(file.resolve(key));
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

void read_security(TableReader table, const ConfigFile& file, SecurityConfig& security) {
  std::string key_file;
  table.read("server_key", key_file);
  security.server_key = file.resolve(key_file);
  if (!key_file.empty()) {
    if (auto key = net::read_secret_key(security.server_key); !key) {
      table.add_error("server_key", key.error().text());
    }
  }
  for (TableReader& client : table.tables("client", kMaxClients))
    read_client(client, file, security.clients);
  if (key_file.empty() && !security.clients.empty()) {
    table.add_error("client",
                    "clients are listed but there is no server_key, so anyone could connect;"
                    " make one with `posed keygen server` and name server.key here");
  }
  table.finish();
}

void read_tables(const toml::table& root_table, const ConfigFile& file, DaemonConfig& config) {
  TableReader root(root_table, "", file.findings);
  root.read("realtime", config.realtime);
  root.read("share_cpu", config.share_cpu);
  if (auto table = root.table("security")) read_security(*table, file, config.security);
  const bool secured = !config.security.server_key.empty();
  if (auto table = root.table("publish")) read_publish(*table, secured, config);
  if (auto table = root.table("control")) read_control(*table, file, secured, config);
  read_streams(root, file, config);
  read_outputs(root, file, config);
  read_record(root, file, config);
  // What is shown is recorded: each take with its clips, which a page can fetch.
  if (!config.recordings.empty() && !config.record) {
    config.record.emplace().folder = config.recordings;
    config.record->clips = true;
  }
  read_trigger(root, config);
  read_metrics(root, config);
  for (const PortClash& clash : port_clashes(config)) {
    const int line = clash.line > 0 ? clash.line : root.line_of(clash.key);
    file.findings.add_error(line, clash.message);
  }
  root.finish();
}

// Every key that a config may have, found by reading a config that has every table. [[output]],
// [trigger] and [metrics] are left out: who misplaces a key of their names (body, listen) means
// that of a stream or source.
std::set<std::string> all_keys(Drivers drivers) {
  std::string text = "[publish]\n[control]\n[security]\n[[security.client]]\n[record]\n";
  for (const drivers::Driver& driver : drivers) {
    const char* table = driver.make_layout == nullptr ? "stream" : "source";
    text += fmt::format("[[{0}]]\ndriver = \"{1}\"\n[{0}.{1}]\n", table, driver.name);
  }
  for (const char* table : {"stream", "source"}) {
    text += fmt::format("[[{}]]\n", table);
    for (const StageType* stage : stage_types()) {
      text += fmt::format("[{}.{}]\n", table, stage->name);
    }
  }
  Findings findings;
  DaemonConfig ignored;
  if (const auto root = parse_toml(text, {}, kLimits)) {
    read_tables(*root, {.folder = {}, .drivers = drivers, .findings = findings}, ignored);
  }
  return std::move(findings.known);
}

// Sockets of a multicast group share its port.
bool clash(const Listener& a, const Listener& b) {
  return a.udp == b.udp && !(a.shared && b.shared) &&
         drivers::overlap(*drivers::parse_endpoint(a.endpoint),
                          *drivers::parse_endpoint(b.endpoint));
}

void add_shared_ports(const DaemonConfig& config, std::vector<PortClash>& clashes) {
  const std::vector<Listener> all = listeners_of(config);
  for (auto second = all.begin(); second != all.end(); ++second) {
    const auto first =
        std::find_if(all.begin(), second, [&](const Listener& one) { return clash(one, *second); });
    if (first == second) continue;
    clashes.push_back({.key = second->key,
                       .line = second->line,
                       .message = fmt::format("{} and {} cannot share the {} endpoint {}; give {}"
                                              " another port",
                                              first->who, second->who, second->udp ? "UDP" : "TCP",
                                              clean(second->endpoint), second->who)});
  }
  // What is no address in numbers is not among them: ipc, the name of an interface.
  if (clashes.empty() && config.publish_endpoint == config.control_endpoint &&
      has_fixed_port(config.publish_endpoint)) {
    clashes.push_back({.key = "control",
                       .message = fmt::format("publish and control cannot share the endpoint {};"
                                              " give control another one",
                                              clean(config.control_endpoint))});
  }
}

}  // namespace

bool is_stream_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxStreamName &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string_view::npos;
}

Reading read_config(const std::string& text, const std::filesystem::path& path, Drivers drivers) {
  Reading reading;
  Findings findings{.file = path.string(),
                    .exit_code = ExitCode::kWrongUse,
                    .all_keys = all_keys(drivers),
                    .twins = {.original = "stream", .copy = "source"}};
  reading.config.text = text;
  const auto root = parse_toml(text, path.string(), kLimits);
  if (root) {
    read_tables(*root, {.folder = path.parent_path(), .drivers = drivers, .findings = findings},
                reading.config);
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

Result<SecurityConfig> load_security(const std::filesystem::path& path) {
  Findings findings{.file = path.string(), .exit_code = ExitCode::kWrongUse};
  SecurityConfig security;
  const auto root_table = TRY(load_toml(path, kLimits));
  TableReader root(root_table, "", findings);
  const ConfigFile file{.folder = path.parent_path(), .drivers = {}, .findings = findings};
  if (auto table = root.table("security")) read_security(*table, file, security);
  root.finish();
  if (findings.errors.empty() && security.server_key.empty()) {
    findings.add_error(0,
                       "there is no server_key; name the NAME.key of `posed keygen` in [security]");
  }
  return findings.result(std::move(security));
}

std::vector<PortClash> port_clashes(const DaemonConfig& config) {
  std::vector<PortClash> clashes;
  add_shared_ports(config, clashes);
  for (const char* option : {"port", "id"}) {
    std::map<std::string, std::string> first;
    for (const StreamConfig& stream : config.streams) {
      const std::string glove = text_option(stream.options, option);
      if (glove.empty()) continue;
      const auto [known, is_new] = first.emplace(glove, stream.name);
      if (is_new) continue;
      clashes.push_back({.key = "stream",
                         .line = stream.line,
                         .message = fmt::format("{} and {} have the same {} {}; a glove serves one"
                                                " stream, so give each its own",
                                                in_quotes(known->second), in_quotes(stream.name),
                                                option, in_quotes(glove))});
    }
  }
  return clashes;
}

}  // namespace posed::config
