#include "proto/text/svg.hpp"

#include <array>
#include <cstdio>

#include "proto/text/clean.hpp"

namespace posed {

std::string svg_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

std::string svg_attribute(std::string_view name, double value) {
  return " " + std::string(name) + "=\"" + svg_number(value) + "\"";
}

std::string svg_text(std::string_view text) {
  std::string out;
  for (const char c : clean(text)) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string svg_document(double width_px, double height_px, std::string_view style,
                         std::string_view elements) {
  const std::string width = svg_number(width_px);
  const std::string height = svg_number(height_px);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + width + " " +
                    height + "\" width=\"" + width + "\" height=\"" + height + "\">\n<style>";
  out += style;
  out += "</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
  out += elements;
  return out + "</svg>\n";
}

}  // namespace posed
