// Parts that every SVG picture of posed uses: numbers, escaped text and the document around the
// elements. Cold.
#pragma once

#include <string>
#include <string_view>

namespace posed {

// A coordinate or length with one decimal, which is a tenth of a pixel.
[[nodiscard]] std::string svg_number(double value);
// Returns ` name="1.0"`, with the blank before it.
[[nodiscard]] std::string svg_attribute(std::string_view name, double value);

// Text for an element: cleaned (proto/text/clean.hpp) and with &, < and > written as XML wants.
[[nodiscard]] std::string svg_text(std::string_view text);

// A whole file with a white background. `style`: CSS rules; `elements`: one after the other, the
// last one on top.
[[nodiscard]] std::string svg_document(double width_px, double height_px, std::string_view style,
                                       std::string_view elements);

}  // namespace posed
