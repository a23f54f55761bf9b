// The natnet driver: skeletons, rigid bodies and markers from OptiTrack's Motive, over UDP.
#include "drivers/natnet/decoder.hpp"
#include "drivers/natnet/emulator.hpp"
#include "drivers/natnet/layout.hpp"
#include "drivers/source_type.hpp"

namespace posed::drivers {
namespace natnet {
namespace {

Result<Settings> settings_of(const Options& options) {
  Settings settings;
  if (const auto& version = option<std::string>(options, "version"); !version.empty()) {
    settings.version = TRY(parse_version(version));
  }
  const auto z_up = TRY(parse_up(option<std::string>(options, "up")));
  const auto coordinates = TRY(parse_coordinates(option<std::string>(options, "coordinates")));
  settings.z_up = z_up;
  settings.coordinates = coordinates;
  settings.unicast = option<bool>(options, "unicast");
  settings.rate_hz = static_cast<int>(option<std::int64_t>(options, "rate_hz"));
  return settings;
}

// The server's address, with the command port if none is given.
Result<Address> server_of(const Options& options) {
  const auto& server = option<std::string>(options, "server");
  if (const auto endpoint = parse_endpoint(server)) return *endpoint;
  if (const auto host = parse_host(server)) {
    return parse_endpoint((server.find(':') == std::string::npos ? server : '[' + server + ']') +
                          ':' + std::to_string(kCommandPort));
  }
  return misuse(
      "server should be the address of the computer with Motive in numbers, like "
      "192.168.1.20, its name if this computer knows it, or one of them with the command port, "
      "192.168.1.20:1510");
}

RT_SAFE std::optional<DataPlace> data_place(std::span<const std::byte> datagram) noexcept {
  Message message;
  ServerInfo info;
  const bool says = decode_message(datagram, message) == Outcome::kOk &&
                    message.id == MessageId::kServerInfo &&
                    decode_server_info(message.payload, info) && info.data_port != 0;
  if (!says) return std::nullopt;
  return DataPlace{.group = info.multicast ? info.group : 0, .port = info.data_port};
}

// The command socket and the data socket. Only the server may send to them.
Result<UdpSettings> sockets_of(const Options& options) {
  const auto server = TRY(server_of(options));
  const bool here = is_loopback(host_of(server));
  const auto& listen = option<std::string>(options, "listen");
  auto command_listen = option<std::string>(options, "command_listen");
  if (command_listen.empty()) {
    const bool v6 = server.storage.ss_family == AF_INET6;
    command_listen = here ? (v6 ? "[::1]:0" : "127.0.0.1:0") : (v6 ? "[::]:0" : "0.0.0.0:0");
  }
  UdpSettings settings{
      .sockets = {{.listen = command_listen, .to = endpoint_text(server)}, {.listen = listen}},
      .data_place = data_place,
      .interface = option<std::string>(options, "interface"),
      .peers = {host_text(server)}};
  if (here && settings.interface.empty()) settings.interface = host_text(server);
  if (!option<bool>(options, "unicast")) {
    settings.sockets[1].group = option<std::string>(options, "group");
  }
  return settings;
}

std::vector<OptionSpec> options() {
  return {
      {.name = "server",
       .default_value = std::string("127.0.0.1"),
       .help = "address of the computer with Motive; the command port is 1510 unless it says "
               "another"},
      {.name = "listen",
       .default_value = std::string("0.0.0.0:1511"),
       .help = "address and port that the frames are sent to; a group's, until the server names "
               "another port"},
      {.name = "command_listen",
       .default_value = std::string(),
       .help = "address and port for the server's answers; left out: any port"},
      {.name = "group",
       .default_value = std::string("239.255.42.99"),
       .help = "multicast group of the frames, until the server names its own; empty: none"},
      {.name = "interface",
       .default_value = std::string(),
       .help = "network interface of the group, by name or address; left out: the system's "
               "choice"},
      {.name = "unicast", .default_value = false, .help = "Motive's transmission type is unicast"},
      {.name = "up", .default_value = std::string("y"), .help = "Motive's up axis, y or z"},
      {.name = "coordinates",
       .default_value = std::string("auto"),
       .help = "Motive's skeleton coordinates, local or global; auto: found out by the lengths of "
               "the bones"},
      {.name = "version",
       .default_value = std::string(),
       .help = "the NatNet version, like 3.0; left out: as the server says"},
      {.name = "rate_hz",
       .default_value = std::int64_t{120},
       .help = "frames a second, until the server says it",
       .min = 1,
       .max = 2000}};
}

struct NatNet : SourceType<NatNet> {
  using Settings = natnet::Settings;
  static constexpr std::string_view kName = "natnet";
  static constexpr std::string_view kSummary =
      "OptiTrack: skeletons, rigid bodies and markers from Motive over NatNet 2.5 to 4";
  static constexpr auto option_specs = natnet::options;
  static constexpr auto settings = natnet::settings_of;
  static constexpr auto device_info = natnet::settings_text;
  static constexpr auto parse_device_info = natnet::parse_settings;
  static constexpr auto make_layout = natnet::make_layout;

  static Result<std::string> check(const Options& options, const Settings& /*settings*/) {
    const auto sockets = TRY(sockets_of(options));
    TRY(check_udp(sockets));
    return "udp " + sockets.sockets[0].to;
  }
  static Result<std::unique_ptr<Decoder>> decoder(const Settings& known,
                                                  const Description& /*description*/) {
    return std::make_unique<NatNetDecoder>(known);
  }
  static Result<std::unique_ptr<Transport>> connect(const Options& options,
                                                    TransportFactory& ports) {
    return ports.udp(*sockets_of(options));
  }
  static Poll poll() { return {.request = {}, .period_ns = Requests::kPeriod_ns}; }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& known) {
    return std::make_unique<NatNetEmulator>(known);
  }
};

}  // namespace
}  // namespace natnet

const Driver& natnet_driver() { return DriverOf<natnet::NatNet>::get(); }

}  // namespace posed::drivers
