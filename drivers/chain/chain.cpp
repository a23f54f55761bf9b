// The posed driver: a stream of another daemon, so that machines chain.
#include "drivers/chain/decoder.hpp"
#include "drivers/chain/emulator.hpp"
#include "drivers/chain/protocol.hpp"
#include "drivers/source_type.hpp"

namespace posed::drivers {
namespace chain {
namespace {

Result<UpstreamInfo> info_of(const Options& options) {
  UpstreamInfo info{.stream = option<std::string>(options, "stream"),
                    .rate_hz = option<double>(options, "rate_hz")};
  if (!is_upstream_stream(info.stream)) {
    return misuse(
        "stream should be the name of a stream of the other daemon: a-z, digits, '-'"
        " and '_'");
  }
  return info;
}

SubscriptionSettings subscription_of(const Options& options) {
  const auto stream = option<std::string>(options, "stream");
  return {.endpoint = option<std::string>(options, "connect"),
          .key = option<std::string>(options, "key"),
          .server_key = option<std::string>(options, "server_key"),
          .topics = {"pose/" + stream, "skeleton/" + stream}};
}

std::vector<OptionSpec> options() {
  return {
      {.name = "connect",
       .default_value = std::string("tcp://127.0.0.1:5570"),
       .help = "the other daemon's publish endpoint, or a relay's"},
      {.name = "stream", .default_value = std::string("walker"), .help = "which of its streams"},
      {.name = "key",
       .default_value = std::string(),
       .is_path = true,
       .help = "own secret key (NAME.key), if the other daemon uses keys"},
      {.name = "server_key",
       .default_value = std::string(),
       .is_path = true,
       .help = "the other daemon's public key (NAME.pub)"},
      rate_option(60.0, "expected frames a second, until the stream says its rate")};
}

struct Upstream : SourceType<Upstream> {
  using Settings = UpstreamInfo;
  static constexpr std::string_view kName = "posed";
  static constexpr std::string_view kSummary = "a stream of another posed, so that machines chain";
  static constexpr auto option_specs = chain::options;
  static constexpr auto settings = chain::info_of;
  static constexpr auto device_info = chain::device_info_text;
  static constexpr auto parse_device_info = chain::parse_device_info;
  static constexpr auto make_layout = chain::make_layout;

  static Result<std::string> check(const Options& options, const Settings& /*settings*/) {
    const SubscriptionSettings subscription = subscription_of(options);
    TRY(check_subscription(subscription));
    return subscription.endpoint;
  }
  static Result<std::unique_ptr<Decoder>> decoder(const Settings& known,
                                                  const Description& /*description*/) {
    return std::make_unique<UpstreamDecoder>(known.stream);
  }
  static Result<std::unique_ptr<Transport>> connect(const Options& options,
                                                    TransportFactory& ports) {
    return ports.subscribe(subscription_of(options));
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& known) {
    return std::make_unique<UpstreamEmulator>(known);
  }
};

}  // namespace
}  // namespace chain

const Driver& posed_driver() { return DriverOf<chain::Upstream>::get(); }

}  // namespace posed::drivers
