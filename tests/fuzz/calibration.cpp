// Any text as a glove's calibration file and as its device info: a mistake gives an
// error message, and an accepted text can be used.
#include <cmath>
#include <cstdint>
#include <string>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/device_info.hpp"
#include "tests/fuzz/demand.hpp"

namespace {

using posed::fuzz::demand;
using namespace posed::drivers::glove;

Model small_model() {
  return {.driver = "small",
          .sensors = {{.name = "bend", .curve = Curve::line(50, 0.0, 150, 1.0)},
                      {.name = "spread", .curve = Curve::line(0, 0.0, 255, 1.0), .unit = "1"}},
          .parameters = {{"bias", 0.5}},
          .map_toml = "[angles]\nbend = [{channel = \"index1_x\"}]\n"};
}

void try_calibration(const std::string& text) {
  const auto file = parse_calibration(text, "fuzz.toml");
  if (!file) return demand(!file.error().message.empty());
  const auto again = parse_calibration(format_calibration(*file), "again.toml");
  demand(again.has_value() && again->sensors == file->sensors && again->user == file->user);
  const auto made = make_calibration(small_model(), *file, file->hand, "");
  if (!made) return demand(!made.error().message.empty());
  for (const float raw : {-1e6F, 0.0F, 77.0F, 1e6F}) {
    for (std::size_t s = 0; s < (*made)->sensors; ++s)
      demand(!std::isnan((*made)->curve[s].value_at(raw)));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] % 2 == 0) {
    try_calibration(text);
  } else {
    DeviceInfoReader reader(text, "toy", "A9");
    (void)reader.side();
    (void)reader.whole("sensors", 18, 22);
    (void)reader.word("form");
    const auto ok = reader.finish();
    demand(ok || ok.error().text().find('\x1b') == std::string::npos);
  }
  return 0;
}
