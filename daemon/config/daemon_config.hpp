// What the daemon is to do, checked and complete: filled from TOML by the config reader, by hand in
// tests and benchmarks, from the log in replay. Every default of the product stands here and
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
  smooth::LiveOptions live;         // the defaults of lag and noise
  std::filesystem::path model;      // the gesture model's file; empty: smooths only
  std::vector<std::string> labels;  // performed from the start
  double tempo = 1.0;
  bool loop = false;
};

struct StreamConfig {
  std::string name;                   // [a-z0-9_-]{1,32}, unique
  std::string driver;                 // registry name
  drivers::Options options;           // of the driver, complete with its defaults
  std::filesystem::path calibration;  // of a glove; empty: the device's default
  bool publish_raw = false;           // the unstyled input too, as <name>-raw
  double stale_after_s = 0.5;         // silence after which the stream is called stale
  std::optional<StyleConfig> style;
  std::optional<GenerateConfig> generate;
  std::optional<bool> constrain;  // fingers held apart and within their limits; default: on hands
};

// Who may connect; CURVE is off when there is no server key.
struct SecurityConfig {
  std::filesystem::path server_key;  // NAME.key; empty: no CURVE
  std::vector<net::AllowedClient> clients;
};

struct DaemonConfig {
  std::string publish_endpoint = "tcp://127.0.0.1:5570";
  bool publish_insecure = false;  // bind beyond loopback without CURVE
  std::string control_endpoint = "tcp://127.0.0.1:5571";
  bool control_insecure = false;
  bool realtime = true;  // ask for SCHED_FIFO and mlockall; refusal is a warning
  SecurityConfig security;
  std::vector<StreamConfig> streams;
  std::string text;  // the TOML it came from, kept in the device log
};

}  // namespace posed::config
