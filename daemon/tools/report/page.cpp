#include "daemon/tools/report/page.hpp"

#include <cmath>
#include <ostream>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/plot.hpp"
#include "daemon/tools/report/style_sheet.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/svg.hpp"

namespace posed::report {
namespace {

std::string element(std::string_view name, std::string_view text) {
  return fmt::format("<{0}>{1}</{0}>\n", name, escaped(text));
}

// `words`: what the picture shows, for who cannot see it.
std::string svg_of(const Drawing& drawing, std::string_view words) {
  return fmt::format(
      "<div class=\"wide\"><svg class=\"{0}\" role=\"img\" aria-label=\"{1}\" viewBox=\"0 0 {2} "
      "{3}\" width=\"{2}\" height=\"{3}\">\n{4}</svg></div>\n",
      drawing.kind, escaped(words), svg_number(drawing.width_px), svg_number(drawing.height_px),
      drawing.elements);
}

// Line by line, because escaped() shows the end of a line instead of beginning a new one.
std::string escaped_lines(std::string_view words, std::string_view end_of_line) {
  std::string out;
  while (true) {
    const auto end = words.find('\n');
    out += escaped(words.substr(0, end));
    if (end == std::string_view::npos) return out;
    out += end_of_line;
    words.remove_prefix(end + 1);
  }
}

std::string cell(std::string_view name, bool number, std::string_view text) {
  return fmt::format("<{0}{1}>{2}</{0}>", name, number ? " class=\"n\"" : "", escaped(text));
}

std::string table_of(const Table& table) {
  std::string html = "<div class=\"wide\"><table>\n<thead><tr>";
  for (const Table::Column& column : table.columns) html += cell("th", column.number, column.title);
  html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      html += cell("td", table.columns[c].number, c < row.size() ? row[c] : "");
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : svg_text(text)) {
    if (c == '"') {
      out += "&quot;";
    } else if (c == '\'') {
      out += "&#39;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  return fmt::format("{:.{}f}", value, digits);
}

Page::Page(std::string title, std::string command)
    : title_(std::move(title)), command_(std::move(command)) {}

void Page::verdict(std::string_view sentence, bool good) {
  body_ += fmt::format("<p class=\"verdict{}\"><b>{}</b> {}</p>\n", good ? "" : " bad",
                       good ? "Verdict:" : "Take care:", escaped_lines(sentence, "<br/>\n"));
}

void Page::warnings(const std::vector<std::string>& sentences) {
  if (sentences.empty()) return;
  body_ += "<ul class=\"warnings\">\n";
  for (const std::string& sentence : sentences) body_ += element("li", sentence);
  body_ += "</ul>\n";
}

void Page::section(std::string_view title) { body_ += element("h2", title); }

void Page::add(const Figure& figure) {
  const std::string title = escaped(figure.title);
  body_ += figure.folded ? "<details><summary><h3>" + title + "</h3></summary>\n"
                         : "<figure>\n<h3>" + title + "</h3>\n";
  body_ += "<p class=\"see\">" + escaped(figure.sentence) + "</p>\n";
  for (const Drawing& drawing : figure.drawings) {
    body_ += svg_of(drawing, figure.title + ": " + figure.sentence);
  }
  for (const Table& table : figure.tables) body_ += table_of(table);
  body_ += figure.folded ? "</details>\n" : "</figure>\n";
}

void Page::text(std::string_view title, std::string_view sentence, std::string_view words) {
  body_ += "<details><summary><h3>" + escaped(title) + "</h3></summary>\n<p class=\"see\">" +
           escaped(sentence) + "</p>\n<pre>" + escaped_lines(words, "\n") + "</pre></details>\n";
}

std::string Page::html() const {
  const std::string title = escaped(title_);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
         "style-src 'unsafe-inline'\"/>\n<title>" +
         title + "</title>\n<style>" + kStyleSheet + "</style>\n</head>\n<body>\n<main>\n<h1>" +
         title + "</h1>\n<p class=\"by\">" + escaped(command_) + "</p>\n" + body_ +
         "</main>\n</body>\n</html>\n";
}

Result<> write_page(const Page& page, const std::filesystem::path& path) {
  return write_whole_file(path, [&](std::ostream& out) { out << page.html(); });
}

}  // namespace posed::report
