// The style model's parse_model on any bytes. The header's checksum rejects nearly all of them, so
// each input is also tested as the payload of a valid header. An accepted model styles a walk.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "models/style/live/apply.hpp"
#include "models/style/model/style_model.hpp"
#include "tests/fuzz/demand.hpp"
#include "tests/fuzz/model_envelope.hpp"
#include "tests/fuzz/walker.hpp"

namespace {

using posed::fuzz::demand;

void apply(const posed::style::StyleModel& model) {
  const auto walk = posed::fuzz::walker(30);
  for (const bool cold : {false, true}) {
    posed::style::ApplyOptions options;
    options.cold = cold;
    options.filter.auto_alpha = true;
    const auto applied = posed::style::apply_to_clip(model, "fuzz", walk, options);
    if (!applied) return;
    demand(applied->clip.frames() == walk.frames());
    demand(applied->max_change_rad < 4.0);  // half a turn; false for NaN
  }
}

void try_bytes(const std::string& bytes) {
  const auto model = posed::style::parse_model(std::as_bytes(std::span(bytes)), "fuzz");
  if (!model) return;
  apply(*model);
  // An accepted model can be written and read back with the same bytes.
  const std::string written = posed::style::serialize_model(*model);
  const auto again = posed::style::parse_model(std::as_bytes(std::span(written)), "fuzz");
  demand(again && posed::style::serialize_model(*again) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  try_bytes(input);
  try_bytes(posed::fuzz::as_model_file(input));
  return 0;
}
