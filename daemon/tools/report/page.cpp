#include "daemon/tools/report/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/plot.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/svg.hpp"

namespace posed::report {
namespace {

// The style sheet of every report. The poses are drawn by daemon/tools/picture for white paper; the
// rules of `.strip` turn its greys and its white outlines to the page's own.
constexpr const char* kStyleSheet = R"(
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--soft:#57606a;--line:#d0d7de;
--card:#f6f8fa;--good:#00664d;--bad:#b03a00;--s0:#0072b2;--s1:#d55e00;--s2:#009e73;--s3:#cc79a7;
--s4:#b58900;--s5:#3b9bd1;--s6:#4d4d4d}
@media (prefers-color-scheme:dark){:root{--paper:#15181c;--ink:#e6e9ed;--soft:#9aa5b1;
--line:#3a424c;--card:#1d2127;
--good:#4cc9a0;--bad:#ff9b66;--s0:#56a9e0;--s1:#ff8a3d;--s2:#33c79b;--s3:#e6a3c6;
--s4:#f0c44c;--s5:#9ad0f5;--s6:#b8bec6}}
@media print{:root{--paper:#fff;--ink:#000;--soft:#444;--line:#bbb;--card:#fff}
figure,tr{break-inside:avoid}h2{break-after:avoid}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:66rem;padding:1.5rem 1.25rem 4rem;background:var(--paper);
color:var(--ink);font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.7rem;line-height:1.25;margin:0 0 .25rem}
h2{font-size:1.3rem;margin:2.5rem 0 .75rem;padding-top:.75rem;border-top:1px solid var(--line)}
h3{font-size:1.05rem;margin:0}
.by,.see{color:var(--soft)}.see{margin:.25rem 0 .75rem;max-width:50rem}
.verdict{margin:1rem 0;padding:.75rem 1rem;border-left:5px solid var(--good);background:var(--card);
font-size:1.1rem}
.verdict.bad{border-color:var(--bad)}.verdict b{color:var(--good)}.verdict.bad b{color:var(--bad)}
ul.warnings{margin:.5rem 0;padding-left:1.25rem}
figure{margin:1.25rem 0 2rem}
figure>svg,details>svg{display:block;margin:.5rem 0}
.wide{overflow-x:auto}
svg{max-width:max(100%,36rem);height:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.92rem;margin:.5rem 0}
th,td{padding:.25rem .75rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
th{color:var(--soft);font-weight:600}
th.n,td.n{text-align:right}
summary{cursor:pointer;padding:.25rem 0}summary h3{display:inline}
pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:.8rem;background:var(--card);padding:1rem}
.chart text,.tree text{font:12px system-ui,sans-serif;fill:var(--ink)}
.chart .end{text-anchor:end}.chart .mid{text-anchor:middle}.chart .quiet{fill:var(--soft)}
.chart .head{font-weight:600}
.chart .grid{stroke:var(--line);stroke-width:1}.chart .frame{stroke:var(--soft);fill:none}
.chart .rule{stroke:var(--soft);stroke-width:1.2;stroke-dasharray:5 4}
.chart .cell{stroke:var(--paper);stroke-width:2}
.chart .tie{stroke:var(--soft);stroke-width:1;opacity:.55}
.chart polyline{fill:none;stroke-width:2;stroke-linejoin:round}
.s0{--c:var(--s0)}.s1{--c:var(--s1)}.s2{--c:var(--s2)}.s3{--c:var(--s3)}.s4{--c:var(--s4)}
.s5{--c:var(--s5)}.s6{--c:var(--s6)}
.stroke{stroke:var(--c)}.fill{fill:var(--c)}.band{fill:var(--c);opacity:.22}
.tree .ask{fill:var(--paper);stroke:var(--soft)}.tree .leaf{fill:var(--card);stroke:var(--s2)}
.tree .way{stroke:var(--soft);fill:none}.tree .quiet{fill:var(--soft)}
.strip text{font:13px system-ui,sans-serif;text-anchor:middle;fill:var(--ink)}
.strip .title{font-weight:600;text-anchor:start}
.strip .row,.strip .see{text-anchor:start}.strip .row{font-weight:600}
.strip line{stroke-linecap:round}.strip .ground{stroke:var(--soft);stroke-linecap:butt}
.strip [stroke="#fff"]{stroke:var(--paper)}
.strip [stroke="#4d4d4d"]{stroke:var(--s6)}.strip [fill="#4d4d4d"]{fill:var(--s6)}
.strip [stroke="#0072b2"]{stroke:var(--s0)}.strip [stroke="#d55e00"]{stroke:var(--s1)}
)";

// The same look for a drawing that is a file: light, and without variables, which programs that
// draw SVG do not know.
constexpr const char* kFileStyle = R"(
text{font:12px system-ui,sans-serif;fill:#1b1f24}.quiet{fill:#57606a}.head{font-weight:600}
.end{text-anchor:end}.mid{text-anchor:middle}.grid{stroke:#d0d7de}.tie{stroke:#57606a;opacity:.55}
.rule{stroke:#57606a;stroke-dasharray:5 4}polyline{fill:none;stroke-width:2}.band{opacity:.22}
.ask{fill:#fff;stroke:#57606a}.leaf{fill:#f6f8fa;stroke:#009e73}.way{stroke:#57606a;fill:none}
)";

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

std::string svg_file(const std::vector<Drawing>& drawings) {
  double width_px = 0.0, height_px = 0.0;
  std::string body;
  for (const Drawing& drawing : drawings) {
    body += fmt::format("<g class=\"{}\" transform=\"translate(0 {})\">\n{}</g>\n", drawing.kind,
                        svg_number(height_px), drawing.elements);
    width_px = std::max(width_px, drawing.width_px);
    height_px += drawing.height_px + 16.0;
  }
  std::string style = kFileStyle;
  constexpr std::array<std::string_view, kSeries> kColours{
      "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#3b9bd1", "#4d4d4d"};
  for (std::size_t s = 0; s < kSeries; ++s) {
    style += fmt::format(".s{0}.stroke{{stroke:{1}}}.s{0}.fill,.s{0}.band{{fill:{1}}}\n", s,
                         kColours[s]);
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\">\n<style>{2}</style>\n<rect width=\"100%\" height=\"100%\" "
      "fill=\"#fff\"/>\n{3}</svg>\n",
      svg_number(width_px), svg_number(height_px), style, body);
}

Result<> write_page(const Page& page, const std::filesystem::path& path) {
  return write_whole_file(path, page.html());
}

}  // namespace posed::report
