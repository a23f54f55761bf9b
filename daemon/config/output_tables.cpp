#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/listeners.hpp"
#include "drivers/transport/address.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/nearest_word.hpp"
#include "proto/text/number.hpp"

namespace posed::config {
namespace {

constexpr std::size_t kMaxOutputs = 16;
constexpr std::size_t kMaxReceivers = 64;
constexpr Range kOutputRate{0.0, 1000.0};  // frames a second
constexpr std::array<std::string_view, 2> kNamesWords{"vrm0", "vrm1"};
constexpr std::array<std::string_view, 2> kRoleWords{"performer", "assistant"};
constexpr std::array<std::string_view, 2> kAxisFormats{"binary", "text"};
constexpr std::array<std::string_view, 2> kMvnFormats{"quaternion", "euler"};
constexpr std::array<std::string_view, 2> kRokokoFormats{"lz4", "json"};
constexpr std::size_t kMaxBodies = 16;       // of an output
constexpr std::size_t kMaxRokokoBodies = 5;  // so many fit into a datagram that is not compressed
constexpr double kMaxPort = 65535.0;
constexpr std::size_t kMaxRos2Streams = 16;
constexpr Range kDdsDomain{0.0, 232.0};  // those above have no ports
constexpr std::size_t kMaxTopic = 128, kMaxInterface = 15;
constexpr std::array<std::string_view, 7> kNatNetVersions{"4.1",  "4.0",  "3.1", "3.0",
                                                          "2.11", "2.10", "2.9"};
constexpr std::string_view kNatNetPort = ":1510";

// The keys that some kinds do not have, with those that do.
struct KindsKey {
  std::string_view key;
  std::vector<OutputKind> kinds;
};
const std::vector<KindsKey>& kinds_keys() {
  using enum OutputKind;
  static const std::vector<KindsKey> keys{
      {"body", {kVmc, kBvh, kAxis, kMvn, kMocopi, kRokoko, kNatNet}},
      {"left_hand", {kVmc}},
      {"right_hand", {kVmc}},
      {"bodies", {kAxis, kMvn, kRokoko, kNatNet}},
      {"to", {kVmc, kAxis, kMvn, kMocopi, kRokoko}},
      {"names", {kVmc}},
      {"role", {kVmc}},
      {"avatar", {kVmc}},
      {"listen", {kBvh, kAxis, kNatNet}},
      {"peers", {kBvh, kAxis, kNatNet, kRos2}},
      {"header", {kBvh}},
      {"format", {kAxis, kMvn, kRokoko}},
      {"group", {kNatNet}},
      {"data_port", {kNatNet}},
      {"version", {kNatNet}},
      {"streams", {kRos2}},
      {"domain", {kRos2}},
      {"interface", {kRos2}},
      {"topic", {kRos2}},
      {"trajectory", {kRos2}}};
  return keys;
}

class OutputReader {
 public:
  OutputReader(const ConfigFile& file, DaemonConfig& config) : file_(file), config_(config) {}

  void read(TableReader& table);

 private:
  void read_vmc(TableReader& table, OutputConfig& output);
  void read_axis(TableReader& table, OutputConfig& output);
  void read_push(TableReader& table, OutputConfig& output);
  void read_natnet(TableReader& table, OutputConfig& output) const;
  void read_kind(TableReader& table, OutputConfig& output);
  void read_ros2(TableReader& table, OutputConfig& output) const;
  void read_bodies(TableReader& table, OutputConfig& output) const;
  void read_list(TableReader& table, const char* key, std::size_t most, OutputConfig& output) const;
  void read_receivers(TableReader& table, OutputConfig& output);
  void read_clients(TableReader& table, OutputConfig& output) const;
  void read_streams(TableReader& table, OutputConfig& output) const;
  void check_stream(TableReader& table, const char* key, const std::string& name) const;
  void check_hand(TableReader& table, const char* key, const std::string& name) const;
  static void refuse_keys(TableReader& table, OutputKind kind);
  void name_it(TableReader& table, OutputConfig& output);
  [[nodiscard]] bool may_be_stream(const std::string& name) const;
  [[nodiscard]] std::set<std::string> stream_names() const;

  const ConfigFile& file_;
  DaemonConfig& config_;
  std::map<std::string, int> lines_;  // of the tables, by the outputs' names
  // The same by kind, whether it has a body, and receiver.
  std::map<std::tuple<OutputKind, bool, std::string>, int> receivers_;
};

std::set<std::string> OutputReader::stream_names() const {
  std::set<std::string> names;
  for (const StreamConfig& stream : config_.streams) names.insert(stream.name);
  for (const SourceConfig& source : config_.sources) {
    for (const auto& named : source.named) names.insert(named.stream.name);
  }
  return names;
}

// Bodies that nobody names become streams under names that begin with their source's.
bool OutputReader::may_be_stream(const std::string& name) const {
  return stream_names().contains(name) ||
         std::ranges::any_of(config_.sources, [&](const SourceConfig& source) {
           return source.all && name.starts_with(source.name + "-");
         });
}

void OutputReader::check_stream(TableReader& table, const char* key,
                                const std::string& name) const {
  if (name.empty() || may_be_stream(name)) return;
  const std::string near = nearest(name, stream_names());
  table.add_error(key, fmt::format("there is no stream named {}; {}", in_quotes(name),
                                   near.empty() ? "name that of a [[stream]] table, or SOURCE-BODY"
                                                  " for a body of streams = \"all\""
                                                : "the nearest is " + in_quotes(near)));
}

// A glove that says which hand it is. Others are told apart by their skeletons while they stream.
void OutputReader::check_hand(TableReader& table, const char* key, const std::string& name) const {
  const auto stream = std::ranges::find(config_.streams, name, &StreamConfig::name);
  if (stream == config_.streams.end()) return;
  const std::string hand = text_option(stream->options, "hand");
  if (hand.empty() || hand + "_hand" == key) return;
  if (hand != "left" && hand != "right") return;  // the driver refuses it
  table.add_error(key, fmt::format("{0} is a {1} hand; name it as {1}_hand, or set hand = \"{2}\""
                                   " in its [[stream]] table",
                                   in_quotes(name), hand, hand == "left" ? "right" : "left"));
}

void OutputReader::read_streams(TableReader& table, OutputConfig& output) const {
  if (output.kind == OutputKind::kRos2) {
    if (!table.need("streams", "name what is sent, like streams = [\"actor1\"]")) return;
    return read_list(table, "streams", kMaxRos2Streams, output);
  }
  const std::array<std::pair<const char*, std::string*>, 3> parts{
      {{"body", &output.body},
       {"left_hand", &output.left_hand},
       {"right_hand", &output.right_hand}}};
  const bool hands = output.kind == OutputKind::kVmc;
  std::set<std::string> taken;
  bool any = false;
  for (const auto& [key, name] : std::span(parts).first(hands ? 3 : 1)) {
    table.read(key, *name);
    // A value that is no text has its error already.
    any = any || !name->empty() || (table.has(key) && !table.has_text(key));
    check_stream(table, key, *name);
    if (key != parts[0].first) check_hand(table, key, *name);
    if (name->empty() || taken.insert(*name).second) continue;
    table.add_error(key, fmt::format("{} is another part of this avatar already; each part has a"
                                     " stream of its own",
                                     in_quotes(*name)));
  }
  any = any || table.has("bodies");
  if (any) return read_bodies(table, output);
  file_.findings.add_error(table.line(),
                           fmt::format("the output names no stream; add body = \"STREAM\"{}",
                                       hands ? ", left_hand or right_hand" : ""));
}

// Several people, instead of one.
void OutputReader::read_bodies(TableReader& table, OutputConfig& output) const {
  if (output.kind == OutputKind::kVmc || !table.has("bodies")) return;
  if (!output.body.empty()) {
    table.add_error("bodies", "body names one person and bodies several: leave one out");
  }
  const bool rokoko = output.kind == OutputKind::kRokoko;
  read_list(table, "bodies", rokoko ? kMaxRokokoBodies : kMaxBodies, output);
}

void OutputReader::read_list(TableReader& table, const char* key, std::size_t most,
                             OutputConfig& output) const {
  const std::size_t errors = file_.findings.errors.size();
  table.read(key, output.bodies);
  if (file_.findings.errors.size() > errors) return;
  if (output.bodies.empty() || output.bodies.size() > most) {
    table.add_error(key, fmt::format("output.{} takes 1 to {} streams", key, most));
  }
  std::set<std::string> taken;
  for (const std::string& name : output.bodies) {
    if (name.empty()) {
      table.add_error(key, "a stream's name is empty; leave it out");
    } else if (!taken.insert(name).second) {
      table.add_error(
          key, fmt::format("{} is listed twice; it would be sent as two people", in_quotes(name)));
    }
    check_stream(table, key, name);
  }
}

// Whether the port of an endpoint is one that a program can have.
bool has_port(std::string_view endpoint) {
  return exact_number<std::uint16_t>(endpoint.substr(endpoint.rfind(':') + 1)).value_or(0) > 0;
}

void OutputReader::read_vmc(TableReader& table, OutputConfig& output) {
  output.vrm1_names = table.choice("names", kNamesWords) == 1;
  output.assistant = table.choice("role", kRoleWords) == 1;
  std::string avatar;
  table.read("avatar", avatar);
  if (!avatar.empty()) output.avatar = file_.resolve(avatar);
  if (table.need("to", "name the receivers, like to = [\"127.0.0.1:39539\"]")) {
    read_receivers(table, output);
  }
}

void OutputReader::read_receivers(TableReader& table, OutputConfig& output) {
  const std::size_t errors = file_.findings.errors.size();
  table.read("to", output.to);
  if (file_.findings.errors.size() > errors) return;
  const bool has_body = !output.body.empty() || !output.bodies.empty();
  std::set<std::string> seen;
  for (const std::string& endpoint : output.to) {
    const auto address = drivers::parse_endpoint(endpoint);
    if (!address || !has_port(endpoint)) {
      table.add_error("to", fmt::format("{} should be an address and a port from 1 to"
                                        " 65535, like 127.0.0.1:39539",
                                        in_quotes(endpoint)));
      continue;
    }
    const std::string receiver = drivers::endpoint_text(*address);
    if (!seen.insert(receiver).second) {
      table.add_error("to", fmt::format("{} is listed twice; it would get each frame twice",
                                        in_quotes(endpoint)));
    }
    // Hands alone may go where another output sends their body.
    const auto first = receivers_.try_emplace({output.kind, has_body, receiver}, output.line).first;
    if (has_body && first->second != output.line) {
      table.add_error("to", fmt::format("{} would take two outputs for one: that in line {}"
                                        " sends to it, too; give each a port",
                                        in_quotes(endpoint), first->second));
    }
  }
  if (output.to.empty() || output.to.size() > kMaxReceivers) {
    table.add_error("to", fmt::format("output.to takes 1 to {} receivers", kMaxReceivers));
  }
}

void OutputReader::read_axis(TableReader& table, OutputConfig& output) {
  if (output.kind == OutputKind::kBvh) {
    table.read("header", output.header);
  } else {
    output.binary = table.choice("format", kAxisFormats) == 0;
  }
  if (!table.has("to")) return read_clients(table, output);
  read_receivers(table, output);
  for (const std::string_view key : {"listen", "peers"}) {
    table.skip(key);
    if (table.has(key)) {
      table.add_error(key, "clients connect over TCP, but \"to\" sends over UDP: leave one out");
    }
  }
}

// Kinds that send to whom the config names, as their programs do.
void OutputReader::read_push(TableReader& table, OutputConfig& output) {
  std::string_view port = "9763";
  if (output.kind == OutputKind::kMvn) output.euler = table.choice("format", kMvnFormats) == 1;
  if (output.kind == OutputKind::kMocopi) port = "12351";
  if (output.kind == OutputKind::kRokoko) {
    output.lz4 = table.choice("format", kRokokoFormats) == 0;
    port = "14043";
  }
  if (table.need("to", fmt::format("name the receivers, like to = [\"127.0.0.1:{}\"]", port))) {
    read_receivers(table, output);
  }
}

void OutputReader::read_natnet(TableReader& table, OutputConfig& output) const {
  output.listen = "127.0.0.1";
  table.read("data_port", output.data_port, {1.0, kMaxPort});
  table.read("group", output.group);
  output.version = kNatNetVersions[table.choice("version", kNatNetVersions)];
  read_clients(table, output);
  if (output.group.empty()) return;
  const auto group = drivers::parse_host(output.group);
  const bool v4 = group && group->storage.ss_family == AF_INET;
  if (!v4 || !drivers::is_multicast(drivers::host_of(*group))) {
    table.add_error("group", fmt::format("{} should be a multicast group, like 239.255.42.99",
                                         in_quotes(output.group)));
  } else if (output.listen.starts_with('[')) {
    table.add_error("group", "to send to a group, listen must be an IPv4 address");
  }
}

// Words of letters, digits and '_' with '/' between them, none of which begins with a digit.
bool is_topic(std::string_view text) {
  bool begins = true;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool digit = c >= '0' && c <= '9';
    if (begins ? !letter : !letter && !digit && c != '/') return false;
    begins = c == '/';
  }
  return !begins && text.size() <= kMaxTopic;
}

// It becomes a part of Cyclone's own settings.
bool is_interface(std::string_view text) {
  return !text.empty() && text.size() <= kMaxInterface && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.' || c == '@';
  });
}

void OutputReader::read_ros2(TableReader& table, OutputConfig& output) const {
  table.read("domain", output.domain, kDdsDomain);
  table.read("interface", output.interface);
  table.read("topic", output.topic);
  table.read("trajectory", output.trajectory);
  table.read("peers", output.peers);
  if (!is_interface(output.interface)) {
    table.add_error("interface", "name one network interface, as `ip -4 address` does");
  }
  if (!output.topic.empty() && !is_topic(output.topic)) {
    table.add_error("topic",
                    "a topic is words of letters, digits and '_' with '/' between them,"
                    " like hand_controller/joint_trajectory");
  } else if (!output.topic.empty() && output.bodies.size() > 1) {
    table.add_error("topic", "one topic is for one robot; give each an [[output]] of its own");
  }
  for (const std::string& peer : output.peers) {
    const auto host = drivers::parse_host(peer);
    if (!host || host->storage.ss_family != AF_INET) {
      table.add_error("peers", fmt::format("{} should be an IPv4 address", in_quotes(peer)));
    }
  }
  if (output.peers.size() > kMaxReceivers) {
    table.add_error("peers", fmt::format("output.peers takes at most {}", kMaxReceivers));
  }
  if (!output.peers.empty() && output.interface == "lo") {
    table.add_error("peers", "other computers are not on \"lo\"; name the interface to them");
  }
  for (const OutputConfig& other : config_.outputs) {
    if (&other == &output || other.kind != OutputKind::kRos2 || other.domain != output.domain ||
        (other.interface == output.interface && other.peers == output.peers)) {
      continue;
    }
    table.add_error("domain",
                    fmt::format("the output in line {} has domain {} with another interface or"
                                " other peers; write the same in both",
                                other.line, other.domain));
  }
}

void OutputReader::read_kind(TableReader& table, OutputConfig& output) {
  switch (output.kind) {
    case OutputKind::kVmc:
      return read_vmc(table, output);
    case OutputKind::kBvh:
    case OutputKind::kAxis:
      return read_axis(table, output);
    case OutputKind::kNatNet:
      return read_natnet(table, output);
    case OutputKind::kRos2:
      return read_ros2(table, output);
    default:
      return read_push(table, output);
  }
}

void OutputReader::read_clients(TableReader& table, OutputConfig& output) const {
  table.read("listen", output.listen);
  // NatNet's clients know the port.
  if (output.kind == OutputKind::kNatNet && drivers::parse_host(output.listen)) {
    const bool v6 = output.listen.find(':') != std::string::npos;
    output.listen = (v6 ? "[" + output.listen + "]" : output.listen) + std::string(kNatNetPort);
  }
  table.read("peers", output.peers);
  for (const std::string& peer : output.peers) {
    if (const auto host = drivers::parse_host(peer); !host) {
      table.add_error("peers", host.error().message);
    }
  }
  const auto address = drivers::listen_address(output.listen, output.peers, "the clients'");
  if (!address) {
    table.add_error("listen", address.error().message);
  } else if (!has_port(output.listen)) {
    table.add_error("listen", "clients must know the port: choose one from 1 to 65535");
  }
}

// Keys that only other kinds have.
void OutputReader::refuse_keys(TableReader& table, OutputKind kind) {
  for (const auto& [key, kinds] : kinds_keys()) {
    if (std::ranges::find(kinds, kind) != kinds.end()) continue;
    table.skip(key);
    if (!table.has(key)) continue;
    std::string words;
    for (const OutputKind other : kinds) {
      add_word(words, fmt::format("\"{}\"", kind_name(other)), " or ");
    }
    table.add_error(key, fmt::format("{} is for outputs of kind = {}; leave it out", key, words));
  }
}

void OutputReader::name_it(TableReader& table, OutputConfig& output) {
  table.read("name", output.name);
  if (!output.name.empty() && !is_stream_name(output.name)) {
    return table.add_error("name",
                           "an output's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  }
  if (output.name.empty()) {
    const std::string first = output.bodies.empty() ? "" : output.bodies.front();
    for (const std::string& stream : {first, output.right_hand, output.left_hand, output.body}) {
      if (!stream.empty()) output.name = fmt::format("{}-{}", kind_name(output.kind), stream);
    }
  }
  const auto [first, is_new] = lines_.try_emplace(output.name, table.line());
  if (is_new || output.name.empty()) return;
  table.add_error("name", fmt::format("a second output is named {} (the first stands in line {});"
                                      " give one of them another name",
                                      in_quotes(output.name), first->second));
}

void OutputReader::read(TableReader& table) {
  OutputConfig& output = config_.outputs.emplace_back();
  output.line = table.line();
  const std::size_t errors = file_.findings.errors.size();
  const bool there =
      table.need("kind", fmt::format("write kind = \"{}\"", fmt::join(kOutputKinds, "\" or \"")));
  output.kind = static_cast<OutputKind>(table.choice("kind", kOutputKinds));
  if (!there || file_.findings.errors.size() > errors) return;
  table.read("rate_hz", output.rate_hz, kOutputRate);
  refuse_keys(table, output.kind);
  read_streams(table, output);
  read_kind(table, output);
  name_it(table, output);
  table.finish();
}

}  // namespace

void read_outputs(TableReader& root, const ConfigFile& file, DaemonConfig& config) {
  OutputReader reader(file, config);
  for (TableReader& table : root.tables("output", kMaxOutputs)) reader.read(table);
}

}  // namespace posed::config
