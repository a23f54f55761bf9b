#include "drivers/file/file.hpp"

#include "drivers/file/decoder.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/file.hpp"
#include "proto/clip/text.hpp"
#include "proto/clip/text_clip.hpp"

namespace posed::drivers {
namespace file {
namespace {

constexpr std::string_view kDefaultHand = "right";

Result<Description> describe(const std::string& text, const std::string& identity) {
  auto format = clip::parse_description(text, identity);
  if (!format) return std::unexpected(format.error());
  return Description{.driver = "file",
                     .text = text,
                     .identity = identity,
                     .skeleton = std::move(format->skeleton),
                     .samples = {},
                     .rate_hz = format->frame_rate_hz};
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  auto format = clip::parse_description(description.text, description.identity);
  if (!format) return std::unexpected(format.error());
  return std::make_unique<ClipDecoder>(std::move(*format));
}

// One chunk per frame, with a line end so that the decoder knows that it is complete.
Chunks frames_of(const clip::TextClip& clip) {
  Chunks chunks;
  for (const std::string_view frame : clip.frames) {
    chunks.add(frame.ends_with('\n') ? std::string(frame) : std::string(frame) + '\n');
  }
  return chunks;
}

// Rejects an option that does not apply to this kind of clip, instead of silently ignoring it.
Result<> check_options(const std::filesystem::path& path, const Options& options) {
  const std::string kind = clip::lower(path.extension().string());
  const auto others = [&path](const char* name, const char* of, const char* instead) {
    return misuse(std::string(name) + " is an option of " + of + "; " + instead, path.string());
  };
  if (kind != ".amc" && option<double>(options, "rate_hz") != 0.0) {
    return others("rate_hz", "an .amc", "this clip says its own rate, and `pace` plays it faster");
  }
  if (kind != ".amc" && !option<std::string>(options, "skeleton").empty()) {
    return others("skeleton", "an .amc", "leave it out");
  }
  if (kind != ".csv" && option<std::string>(options, "hand") != kDefaultHand) {
    return others("hand", "a .csv", "leave it out");
  }
  if (kind != ".csv" && option<std::string>(options, "hand_shape") != kDefaultHandShape) {
    return others("hand_shape", "a .csv", "leave it out");
  }
  if (kind == ".csv" && !option<std::string>(options, "profile").empty()) {
    return others("profile", "a .bvh or an .amc", "leave it out");
  }
  return {};
}

Result<Device> open(const Options& given, TransportFactory& /*ports*/) {
  const auto options = complete_options(file_driver(), given);
  if (!options) return std::unexpected(options.error());
  const std::string path = option<std::string>(*options, "path");
  const std::string hand = option<std::string>(*options, "hand");
  if (hand != "left" && hand != "right") return misuse("hand is left or right");
  if (auto ok = check_options(path, *options); !ok) return std::unexpected(ok.error());
  const double rate_hz = option<double>(*options, "rate_hz");
  const clip::ReadOptions read{
      .asf = option<std::string>(*options, "skeleton"),
      .amc_rate_hz = rate_hz == 0.0 ? clip::ReadOptions{}.amc_rate_hz : rate_hz,
      .metres_per_unit = std::nullopt,
      .profile = option<std::string>(*options, "profile"),
      .hand = hand == "left" ? Side::kLeft : Side::kRight,
      .hand_shape = option<std::string>(*options, "hand_shape")};
  const auto clip = clip::open_text_clip(path, read);
  if (!clip) return std::unexpected(clip.error());
  auto device = make_device(file_driver(), (*clip)->description, path);
  if (!device) return device;
  auto transport = FileTransport::open(frames_of(**clip), {.rate_hz = device->description.rate_hz,
                                                           .pace = option<double>(*options, "pace"),
                                                           .loop = option<bool>(*options, "loop"),
                                                           .time_s = (*clip)->time_s});
  if (!transport) {
    Error error = transport.error();
    error.file = path;
    return std::unexpected(std::move(error));
  }
  device->transport = std::move(*transport);
  device->warnings = (*clip)->warnings;
  return device;
}

std::vector<OptionSpec> options() {
  return {
      {.name = "path",
       .default_value = std::string(),
       .required = true,
       .is_path = true,
       .help = "the clip: a .bvh, an .amc or a hand as .csv"},
      {.name = "skeleton",
       .default_value = std::string(),
       .is_path = true,
       .help = "the .asf of an .amc; left out, NN.asf beside NN_MM.amc"},
      {.name = "loop", .default_value = true, .help = "begin again after the last frame"},
      {.name = "pace",
       .default_value = 1.0,
       .help = "factor on the clip's own speed; 0 is as fast as possible"},
      {.name = "rate_hz",
       .default_value = 0.0,
       .help = "frames a second of an .amc, which does not say; 0 is 120"},
      {.name = "profile",
       .default_value = std::string(),
       .help = "skeleton profile; left out, found by the joints' names"},
      {.name = "hand",
       .default_value = std::string(kDefaultHand),
       .help = "whose hand a .csv is: left or right"},
      {.name = "hand_shape",
       .default_value = std::string(kDefaultHandShape),
       .help = "of a .csv's hand: a name in config/hands"},
  };
}

}  // namespace
}  // namespace file

const Driver& file_driver() {
  static const Driver driver{.name = "file",
                             .summary = "a BVH or AMC clip or a hand CSV, played by its own clock",
                             .options = file::options(),
                             .open = file::open,
                             .make_decoder = file::make_decoder,
                             .describe = file::describe};
  return driver;
}

}  // namespace posed::drivers
