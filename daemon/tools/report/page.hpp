// Page: one self-contained HTML file. Its style sheet and figures are inside, it loads nothing (a
// content security policy forbids it), it follows the reader's light or dark preference, and it
// prints. It is written so that an XML parser reads it, too. All text but Drawing::elements is
// escaped here. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::report {

// Text for an element or an attribute.
[[nodiscard]] std::string escaped(std::string_view text);

// A number for people: `digits` after the point; a dash where it is not finite.
[[nodiscard]] std::string number_text(double value, int digits);

struct Table {
  struct Column {
    std::string title;   // with its unit
    bool number = true;  // set to the right
  };
  std::vector<Column> columns;
  // [row][column], not escaped. A short row gets empty cells, a long one loses the rest.
  std::vector<std::vector<std::string>> rows;
};

// A picture as SVG elements.
struct Drawing {
  double width_px = 0.0, height_px = 0.0;
  std::string elements;        // escaped already
  std::string kind = "chart";  // a class of the style sheet
};

// What a section shows: drawings and tables, below a sentence that says what to see.
struct Figure {
  std::string title;
  std::string sentence;
  std::vector<Drawing> drawings;
  std::vector<Table> tables;
  bool folded = false;  // shown when the reader asks for it
};

class Page {
 public:
  // `command`: the words that made it, "posed train style".
  Page(std::string title, std::string command);

  // Call it first. A sentence or one a line, and whether it is good news.
  void verdict(std::string_view sentence, bool good);
  void warnings(const std::vector<std::string>& sentences);
  void section(std::string_view title);
  void add(const Figure& figure);
  // Text as it is, folded away.
  void text(std::string_view title, std::string_view sentence, std::string_view words);

  [[nodiscard]] std::string html() const;

 private:
  std::string title_, command_, body_;
};

// Drawings below one another as an SVG file that needs no page: on white paper.
[[nodiscard]] std::string svg_file(const std::vector<Drawing>& drawings);

// Writes all of it or nothing.
Result<> write_page(const Page& page, const std::filesystem::path& path);

}  // namespace posed::report
