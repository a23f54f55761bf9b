// A pose as text for a terminal: Unicode's braille patterns have 2 x 4 dots a character. Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/picture/strip.hpp"

namespace posed::picture {

// The figure as UTF-8, one string a row. A row has exactly `columns` characters, and blanks where
// no dot is set. `room`: what must fit, of layout_of() with this camera; poses that share it have
// one scale, and what reaches beyond it is cut off. It lies in the middle, at the bottom. A
// character's place is taken as twice as high as wide, as in most terminals. Not finite: blanks.
[[nodiscard]] std::vector<std::string> braille(const Figure& figure, const Camera& camera,
                                               const StripLayout& room, int columns, int rows);

}  // namespace posed::picture
