#include "daemon/config/config.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/toml_reader.hpp"
#include "daemon/net/keys.hpp"
#include "models/gesture/play_order.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/nearest_word.hpp"
#include "proto/text/toml.hpp"

namespace posed::config {
namespace {

using config::DaemonConfig;
using config::SecurityConfig;
using config::StreamConfig;

constexpr Range kAlpha{-2.0, 2.0};
constexpr Range kAlphaSlew{0.01, 1000.0};
constexpr Range kGateFallback{0.0, 1.0};
constexpr Range kTempo{gesture::kMinTempo, gesture::kMaxTempo};
constexpr Range kLag_ms{0.0, smooth::kMaxLag_s * 1e3};
constexpr Range kNoise_deg{0.0, 90.0};
constexpr Range kStaleAfter{0.01, 3600.0};
constexpr Range kAnyNumber{std::numeric_limits<double>::lowest(),
                           std::numeric_limits<double>::max()};
constexpr double kDegrees = 180.0 / std::numbers::pi;  // degrees in a radian
// Above 60 Hz the lag is limited as a time; at no frame rate is that time longer than this many
// frames.
constexpr std::int64_t kMaxLagFrames = 170;
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
  void read_option(TableReader& table, const drivers::OptionSpec& spec,
                   drivers::OptionValue& value);
  void read_style(TableReader table, config::StyleConfig& style);
  void read_generate(TableReader table, config::GenerateConfig& generate);
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
  if (auto style = table.table("style")) read_style(*style, stream.style.emplace());
  if (auto generate = table.table("generate")) {
    read_generate(*generate, stream.generate.emplace());
  }
  if (auto constrain = table.table("constrain")) {
    constrain->read("enabled", stream.constrain.emplace(true));
    constrain->finish();
  }
  if (!stream.name.empty() && !is_stream_name(stream.name)) {
    table.add_error("name", "a stream's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  }
  const auto driver = std::ranges::find(drivers_, stream.driver, &drivers::Driver::name);
  if (driver != drivers_.end()) {
    read_options(table, *driver, stream.options);
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
    if (beside) read_option(stream_table, spec, value);
    if (!beside && table) read_option(*table, spec, value);
    if (spec.required && !(beside ? stream_table.has(key) : table && table->has(key))) {
      findings_.add_error(table ? table->line() : stream_table.line(),
                          fmt::format("stream.{}.{} is missing: {}", name, key, spec.help));
    }
    options[key] = std::move(value);
  }
  if (table) table->finish();
}

void Reader::read_option(TableReader& table, const drivers::OptionSpec& spec,
                         drivers::OptionValue& value) {
  const std::string key(spec.name);
  if (auto* flag = std::get_if<bool>(&value)) table.read(key.c_str(), *flag);
  if (auto* integer = std::get_if<std::int64_t>(&value)) table.read(key.c_str(), *integer);
  if (auto* number = std::get_if<double>(&value)) table.read(key.c_str(), *number, kAnyNumber);
  if (auto* text = std::get_if<std::string>(&value)) {
    table.read(key.c_str(), *text);
    if (spec.is_path) *text = resolve(*text).string();
  }
}

void Reader::read_style(TableReader table, config::StyleConfig& style) {
  std::string model;
  table.require("model", model);
  style.model = resolve(model);
  table.read("alpha", style.filter.alpha, kAlpha);
  table.read("alpha_slew_per_s", style.filter.alpha_slew_per_s, kAlphaSlew);
  table.read("gate", style.filter.gate);
  table.read("gate_fallback", style.filter.gate_fallback, kGateFallback);
  table.read("calibrate", style.filter.calibrate);
  table.finish();
}

void Reader::read_generate(TableReader table, config::GenerateConfig& generate) {
  std::int64_t lag_frames = generate.live.lag.frames;
  double lag_ms = generate.live.lag.seconds * 1e3;
  double noise_deg = generate.live.noise_rad * kDegrees;
  std::string model, labels;
  table.read("lag_frames", lag_frames);
  if (lag_frames < 0 || lag_frames > kMaxLagFrames) {
    table.add_error("lag_frames", fmt::format("stream.generate.lag_frames = {} is out of range: it"
                                              " takes 0 to {} frames",
                                              lag_frames, kMaxLagFrames));
    lag_frames = generate.live.lag.frames;
  }
  table.read("lag_ms", lag_ms, kLag_ms);
  table.read("noise_deg", noise_deg, kNoise_deg);
  table.read("model", model);
  table.read("labels", labels);
  table.read("tempo", generate.tempo, kTempo);
  table.read("loop", generate.loop);
  generate.live = {.lag = {.frames = static_cast<int>(lag_frames), .seconds = lag_ms * 1e-3},
                   .noise_rad = noise_deg / kDegrees};
  generate.model = resolve(model);
  generate.labels = gesture::split_labels(labels);
  if (generate.labels.size() > gesture::kMostLabels) {
    table.add_error("labels", fmt::format("{} labels are too many at once; give at most {}",
                                          generate.labels.size(), gesture::kMostLabels));
  }
  if (!generate.labels.empty() && model.empty()) {
    table.add_error("labels",
                    "labels need a gesture model to perform them; add model = \"H.gesture\"");
  }
  table.finish();
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
    text += fmt::format(
        "[[stream]]\ndriver = \"{0}\"\n[stream.{0}]\n[stream.style]\n[stream.generate]\n"
        "[stream.constrain]\n",
        driver.name);
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
