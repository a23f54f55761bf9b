// The settings of the daemon, checked and complete. They are filled from TOML by the config reader,
// by hand in tests and benchmarks, and from the log in replay. Every default is defined here, or in
// a lower folder that has a use for it, too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/net/security.hpp"
#include "daemon/system/stale.hpp"
#include "drivers/driver.hpp"
#include "models/stage_type.hpp"

namespace posed::config {

// One stage of a stream, from its table.
struct StageConfig {
  const StageType* type = nullptr;
  Parameters parameters{};        // complete
  std::filesystem::path model{};  // the model's file; empty: none
  // [StageType::partners] where the config names them, for errors; 0: nowhere.
  std::vector<int> partner_lines{};
};

struct StreamConfig {
  std::string name;                   // [a-z0-9_-]{1,32}, unique
  std::string driver;                 // as in the registry
  drivers::Options options;           // of the driver, complete with its defaults
  std::filesystem::path calibration;  // of a glove; empty: use the device's default
  bool publish_raw = false;           // publish the unstyled input too, as <name>-raw
  double stale_after_s = system::kStaleAfter_s;
  // In the order in which they run. Some stages are there without a table (StageType::is_default);
  // they are not in this list, because only the opened device says what its skeleton is.
  std::vector<StageConfig> stages;
  bool default_stages = true;         // false: the list is complete
  std::vector<const StageType*> off;  // stages whose table says enabled = false
  int line = 0;                       // of its table, for errors; 0: nowhere
};

// A device. Where it has several bodies (Driver::make_layout), they become streams as they come.
struct SourceConfig {
  // One of its bodies, by the device's own name for it: a [[stream]] table with source and body.
  struct NamedBody {
    std::string body;     // empty: the one body of a device that does not describe its bodies
    StreamConfig stream;  // without driver and options; a calibration only for the one body
  };

  std::string name;  // [a-z0-9_-]{1,32}, unique among streams and sources
  std::string driver;
  drivers::Options options;  // complete
  double rate_hz = 0.0;      // frames a second of each body; 0: what the driver says, or else 120
  std::filesystem::path skeleton{};  // the user's mapping of its bodies' joints; empty: none
  std::vector<NamedBody> named;
  // Whether the other bodies are streamed, too (streams = "all"), as <source>-<body>. `every` is
  // what is common to them: a stream without name, driver, options and calibration.
  bool all = false;
  StreamConfig every;
  int line = 0;  // of its table, for errors; 0: nowhere
};

// The source of a stream with a device of its own.
[[nodiscard]] inline SourceConfig source_of(const StreamConfig& stream) {
  SourceConfig source;
  source.name = stream.name;
  source.driver = stream.driver;
  source.options = stream.options;
  source.named.push_back({.body = {}, .stream = stream});
  source.line = stream.line;
  return source;
}

enum class OutputKind : std::uint8_t { kVmc, kBvh, kAxis, kMvn, kMocopi, kRokoko, kNatNet, kRos2 };
inline constexpr std::array<std::string_view, 8> kOutputKinds{"vmc",    "bvh",    "axis",   "mvn",
                                                              "mocopi", "rokoko", "natnet", "ros2"};

// As in the config.
[[nodiscard]] constexpr std::string_view kind_name(OutputKind kind) noexcept {
  return kOutputKinds[static_cast<std::size_t>(kind)];
}

// Another way out for the frames of some streams, beside ZeroMQ.
struct OutputConfig {
  std::string name;  // [a-z0-9_-]{1,32}, or KIND-STREAM where the file does not say; unique
  OutputKind kind = OutputKind::kVmc;
  std::string body, left_hand, right_hand;  // streams; at least one is not empty, or there are
  std::vector<std::string> bodies;          // several people, of kinds that have them; of ros2 all
  [[nodiscard]] std::size_t people() const { return bodies.empty() ? 1 : bodies.size(); }
  double rate_hz = 0.0;         // at most so many frames a second; 0: all
  std::vector<std::string> to;  // addresses and ports, over UDP
  // vmc
  bool vrm1_names = false;         // of blend shapes; false: those of VRM 0
  bool assistant = false;          // sends hands only
  std::filesystem::path avatar{};  // whose bones, rest pose and floor count; empty: the performer's
  // bvh, axis
  bool binary = false;                    // messages of Axis Neuron; false: lines of text
  std::string listen = "127.0.0.1:7002";  // where clients connect over TCP, unless `to` names some;
                                          // of natnet where they ask, over UDP
  std::vector<std::string> peers;         // addresses that may connect; empty: this machine
  bool header = false;                    // clients get a BVH's HIERARCHY first
  bool euler = false;                     // mvn: angles instead of quaternions
  bool lz4 = true;                        // rokoko: compressed
  // natnet
  std::string group;            // where everybody gets the frames, too; empty: nowhere
  int data_port = 1511;         // of the group
  std::string version = "4.1";  // of the group
  // ros2; peers are other computers
  int domain = 0;
  std::string interface = "lo";
  std::string topic;        // of a robot's commands; empty: posed/STREAM/joint_commands
  bool trajectory = false;  // commands are trajectories of one point, for controllers
  int line = 0;             // of its table, for errors; 0: nowhere
};

// `posed run` records from its start.
struct RecordConfig {
  std::filesystem::path folder = "takes";  // of the logs, which are named after their time
  bool frames = false;                     // keep the published frames, too
  bool clips = false;                      // each take of each stream as a BVH, when it ends
  int line = 0;                            // of the folder, for errors; 0: nowhere
};

// Where capture systems say that a recording begins or ends.
struct TriggerConfig {
  std::string listen = "127.0.0.1:1512";  // address and port, UDP
  std::vector<std::string> peers;         // addresses that may send; empty: this machine
};

// Figures for Prometheus, over HTTP.
struct MetricsConfig {
  std::string listen = "127.0.0.1:5572";  // address and port, on loopback
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
  std::filesystem::path models;  // the folder whose models control may use by name; empty: none
  // The folder whose logs and clips control may list and fetch by name; empty: none. Without
  // [record] `posed run` records there.
  std::filesystem::path recordings;
  bool realtime = true;   // ask for SCHED_FIFO and mlockall; a refusal is only a warning
  bool share_cpu = true;  // with real-time rights the hot threads share a CPU (system/hot_cpu.hpp)
  SecurityConfig security;
  std::vector<StreamConfig> streams;  // of devices with one body
  std::vector<SourceConfig> sources;
  std::vector<OutputConfig> outputs;
  std::optional<RecordConfig> record;
  std::optional<TriggerConfig> trigger;
  std::optional<MetricsConfig> metrics;
  // How many streams there may be at once, with those that come while the daemon runs. Memory is
  // set aside for all of them only if there is a source.
  int max_streams = 64;
  std::string text;  // the TOML text of the config, kept in the device log
};

}  // namespace posed::config
