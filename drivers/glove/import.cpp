#include "drivers/glove/import.hpp"

#include "drivers/glove/import_parts.hpp"
#include "drivers/glove/load_calibration.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers::glove {

Result<CalibrationFile> import_calibration(const std::filesystem::path& path, const Model& model,
                                           Side hand) {
  const std::string file = path.string();
  if (model.driver != "cyberglove") {
    return fail("calibrations are imported for driver 'cyberglove' only; calibrate this glove",
                file);
  }
  const auto loaded = load_calibration_text(path);
  if (!loaded) return std::unexpected(loaded.error());
  const std::string_view text = clip::trim(clip::without_bom(*loaded));
  CalibrationFile made{.driver = model.driver,
                       .glove = {},
                       .user = {},
                       .hand = hand,
                       .parameters = {},
                       .sensors = {}};
  const std::string_view first_line = text.substr(0, text.find('\n'));
  Result<> read;
  if (text.starts_with('<')) {
    read = import_shadow(text, file, made);
  } else if (first_line.starts_with("VH") || text.contains("GLOVE CALIBRATION") ||
             text.contains("FINGER ")) {
    read = import_virtual_hand(text, file, made);
  } else if (first_line.contains(':')) {
    read = import_asr(text, file, made);
  } else {
    return fail("is no calibration that posed knows: VirtualHand's or asr's .cal, Shadow's XML",
                file);
  }
  if (!read) return std::unexpected(read.error());
  if (made.hand != hand) {
    return fail(std::string("this calibration is of the other hand; import it with --hand ") +
                    (hand == Side::kLeft ? "right" : "left"),
                file);
  }
  // A file may parse and still be impossible for a hand: compiling it is the final check.
  const auto compiled = make_calibration(model, made, hand, {});
  if (!compiled) return fail(compiled.error().message, file);
  return made;
}

}  // namespace posed::drivers::glove
