// The file driver: a clip of any format that posed reads, played as if it were a device.
#include "drivers/transport/file.hpp"
#include "drivers/file/decoder.hpp"
#include "drivers/options.hpp"
#include "proto/clip/device_clip.hpp"
#include "proto/clip/figure.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/profile.hpp"

namespace posed::drivers {

const Driver& file_driver();

namespace file {
namespace {

constexpr std::string_view kDefaultHand = "right";

Result<Description> describe(const std::string& text, const std::string& identity) {
  auto coding = TRY(clip::parse_description(text, identity));
  return Description{.driver = "file",
                     .text = text,
                     .identity = identity,
                     .skeleton = std::move(coding.skeleton),
                     .samples = {},
                     .rate_hz = coding.frame_rate_hz};
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  auto coding = TRY(clip::parse_description(description.text, description.identity));
  return std::make_unique<ClipDecoder>(std::move(coding));
}

// One chunk per frame.
Chunks chunks_of(const clip::DeviceClip& clip) {
  Chunks chunks;
  for (const std::string& frame : clip.frames) chunks.add(frame);
  return chunks;
}

// A value that is the option's default counts as not given. Whether the clip's format accepts the
// others, the table of formats says.
Result<clip::ReadOptions> read_options(const Options& options) {
  clip::ReadOptions read;
  read.skeleton = option<std::string>(options, "skeleton");
  if (const auto rate_hz = option<double>(options, "rate_hz"); rate_hz != 0.0) {
    read.rate_hz = rate_hz;
  }
  read.profile = option<std::string>(options, "profile");
  if (const auto up = option<std::string>(options, "up"); !up.empty()) {
    read.up = up_from_text(up);
    if (!read.up) return misuse("up is +y, +z, -y, -z or +x");
  }
  if (const auto facing = option<std::string>(options, "facing"); !facing.empty()) {
    read.facing = axis_from_text(facing);
    if (!read.facing) return misuse("facing is +x, -x, +y, -y, +z or -z");
  }
  if (const auto unit = option<std::string>(options, "unit"); !unit.empty()) {
    read.metres_per_unit = clip::metres_of_unit(unit);
    if (!read.metres_per_unit) {
      return misuse("unit is m, dm, cm, mm, inch, foot or a number of metres");
    }
  }
  if (option<std::string>(options, "hand") != kDefaultHand) read.hand = Side::kLeft;
  read.hand_shape = option<std::string>(options, "hand_shape");
  return read;
}

Result<Device> open(const Options& given, TransportFactory& /*ports*/) {
  const auto options = TRY(complete_options(file_driver(), given));
  const std::string path = option<std::string>(options, "path");
  const std::string hand = option<std::string>(options, "hand");
  if (hand != "left" && hand != "right") return misuse("hand is left or right");
  const auto read = TRY(read_options(options));
  const auto clip = TRY(clip::open_device_clip(path, read));
  auto device = TRY(make_device(file_driver(), clip.description, path));
  auto transport =
      FileTransport::open(chunks_of(clip), {.rate_hz = device.description.rate_hz,
                                            .pace = option<double>(options, "pace"),
                                            .loop = option<bool>(options, "loop"),
                                            .again_from = clip.begins_with_added_pose ? 1U : 0U,
                                            .time_s = clip.time_s});
  if (!transport) {
    Error error = transport.error();
    error.file = path;
    return std::unexpected(std::move(error));
  }
  device.transport = std::move(*transport);
  device.warnings = clip.warnings;
  return device;
}

std::vector<OptionSpec> options() {
  // OptionSpec::help is a view, so the text lives as long as the driver.
  static const std::string what = "the clip: " + clip::listed(clip::Use::kRead);
  return {
      {.name = "path",
       .default_value = std::string(),
       .required = true,
       .is_path = true,
       .help = what},
      {.name = "skeleton",
       .default_value = std::string(),
       .is_path = true,
       .help = "the skeleton of an .amc, an .asf; left out, NN.asf beside NN_MM.amc"},
      {.name = "loop",
       .default_value = true,
       .help = "begin again after the last frame, without a rest pose in front of the motion"},
      {.name = "pace",
       .default_value = 1.0,
       .help = "factor on the clip's own speed; 0 is as fast as possible"},
      {.name = "rate_hz",
       .default_value = 0.0,
       .help = "frames a second of an .amc, which does not say; 0 is 120"},
      {.name = "profile",
       .default_value = std::string(),
       .is_path = true,
       .help = "skeleton profile: a name, or a file that `posed inspect --write` made; left out, "
               "the figure is recognised",
       .path_ending = kProfileEnding},
      {.name = "up",
       .default_value = std::string(),
       .help = "the axis of a clip that points up, such as +z; left out, recognised"},
      {.name = "facing",
       .default_value = std::string(),
       .help = "the axis of a clip that its zero pose faces, such as +z; left out, recognised"},
      {.name = "unit",
       .default_value = std::string(),
       .help = "of a clip: m, dm, cm, mm, inch, foot or a number of metres; left out, recognised"},
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
                             .summary = "a clip of a body or a hand, played by its own clock",
                             .options = file::options(),
                             .open = file::open,
                             .make_decoder = file::make_decoder,
                             .describe = file::describe};
  return driver;
}

}  // namespace posed::drivers
