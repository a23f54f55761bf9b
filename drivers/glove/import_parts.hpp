// The parsers for the three kinds of file in import.hpp, each in its own source file. Cold.
#pragma once

#include <string>
#include <string_view>

#include "drivers/glove/calibration_file.hpp"

namespace posed::drivers::glove {

[[nodiscard]] Result<> import_virtual_hand(std::string_view text, const std::string& file,
                                           CalibrationFile& into);
[[nodiscard]] Result<> import_asr(std::string_view text, const std::string& file,
                                  CalibrationFile& into);
[[nodiscard]] Result<> import_shadow(std::string_view text, const std::string& file,
                                     CalibrationFile& into);

[[nodiscard]] inline std::unexpected<Error> cut_off(const std::string& file, int line = 0) {
  return fail("this calibration is not whole; was the file cut off?", file, line);
}

}  // namespace posed::drivers::glove
