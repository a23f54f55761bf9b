#include "drivers/labels/labels.hpp"

#include <sstream>

#include "drivers/labels/decoder.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/file.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace labels {
namespace {

constexpr double kMaxRate_hz = 1000.0;

struct Header {
  Side side = Side::kRight;
  double rate_hz = 0.0;
};

std::string text_of(const std::string& side, double rate_hz) {
  return side + " " + std::to_string(rate_hz);
}

// Parses "right 30.000000".
Result<Header> parse_text(const std::string& text, const std::string& identity) {
  std::istringstream words(text);
  std::string side, rest;
  Header header;
  words >> side >> header.rate_hz;
  header.side = side == "left" ? Side::kLeft : Side::kRight;
  const bool sided = side == "left" || side == "right";
  if (!words || words >> rest || !sided || !(header.rate_hz >= 1.0) ||
      header.rate_hz > kMaxRate_hz) {
    return fail("the description of a labels stream is damaged", identity);
  }
  return header;
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto header = parse_text(text, identity);
  if (!header) return std::unexpected(header.error());
  return Description{.driver = "labels",
                     .text = text,
                     .identity = identity,
                     .skeleton = std::make_shared<const Skeleton>(hand_skeleton(header->side)),
                     .samples = {},
                     .rate_hz = header->rate_hz};
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  return std::make_unique<LabelsDecoder>(description.skeleton, description.rate_hz);
}

Result<Device> open(const Options& given, TransportFactory& /*ports*/) {
  const auto options = complete_options(labels_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto& side = option<std::string>(*options, "side");
  const double rate_hz = option<double>(*options, "rate_hz");
  if (side != "left" && side != "right") return misuse("side should be \"left\" or \"right\"");
  if (!(rate_hz >= 1.0 && rate_hz <= kMaxRate_hz)) {
    return misuse("rate_hz should be 1 to 1000 frames a second");
  }
  auto device = make_device(labels_driver(), text_of(side, rate_hz), side + " hand");
  if (!device) return device;
  Chunks beat;
  beat.add(LabelsDecoder::kBeat);
  auto transport = FileTransport::open(std::move(beat), {.rate_hz = device->description.rate_hz});
  if (!transport) return std::unexpected(transport.error());
  device->transport = std::move(*transport);
  return device;
}

}  // namespace
}  // namespace labels

const Driver& labels_driver() {
  static const Driver driver{
      .name = "labels",
      .summary =
          "a hand without a device that performs gesture labels (needs a [stream.generate] table)",
      .options = {{.name = "side", .default_value = std::string("right"), .help = "left or right"},
                  {.name = "rate_hz", .default_value = 30.0, .help = "frames a second"}},
      .open = labels::open,
      .make_decoder = labels::make_decoder,
      .describe = labels::describe};
  return driver;
}

}  // namespace posed::drivers
