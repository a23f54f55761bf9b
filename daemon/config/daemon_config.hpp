// The settings of the daemon, checked and complete. They are filled from TOML by the config reader,
// by hand in tests and benchmarks, and from the log in replay. Every default is defined here and
// nowhere else.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/net/security.hpp"
#include "drivers/driver.hpp"
#include "models/smooth/live_options.hpp"
#include "models/style/style_filter.hpp"

namespace posed::config {

struct StyleConfig {
  std::filesystem::path model;  // the model file
  style::FilterOptions filter;
};

struct GenerateConfig {
  smooth::LiveOptions live;         // lag and noise, with their defaults
  std::filesystem::path model;      // the gesture model's file; empty: only smooth
  std::vector<std::string> labels;  // performed from the start
  double tempo = 1.0;
  bool loop = false;
};

struct StreamConfig {
  std::string name;                   // [a-z0-9_-]{1,32}, unique
  std::string driver;                 // as in the registry
  drivers::Options options;           // of the driver, complete with its defaults
  std::filesystem::path calibration;  // of a glove; empty: use the device's default
  bool publish_raw = false;           // publish the unstyled input too, as <name>-raw
  double stale_after_s = 0.5;         // after this long without data the stream is stale
  std::optional<StyleConfig> style;
  std::optional<GenerateConfig> generate;
  // keep fingers apart and joints within their limits; default: on for hands
  std::optional<bool> constrain;
};

// Who may connect; without a server key CURVE is off.
struct SecurityConfig {
  std::filesystem::path server_key;  // NAME.key; empty: no CURVE
  std::vector<net::AllowedClient> clients;
};

struct DaemonConfig {
  std::string publish_endpoint = "tcp://127.0.0.1:5570";
  bool publish_insecure = false;  // allow binding beyond loopback without CURVE
  std::string control_endpoint = "tcp://127.0.0.1:5571";
  bool control_insecure = false;
  bool realtime = true;  // ask for SCHED_FIFO and mlockall; a refusal is only a warning
  SecurityConfig security;
  std::vector<StreamConfig> streams;
  std::string text;  // the TOML text of the config, kept in the device log
};

}  // namespace posed::config
