#include "daemon/metrics/text_format.hpp"

#include <cmath>
#include <cstddef>
#include <iterator>

#include <spdlog/fmt/fmt.h>

#include "proto/frame/time.hpp"

namespace posed::metrics {
namespace {

std::string number_text(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0.0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

void append_escaped(std::string& text, std::string_view value) {
  for (const char sign : value) {
    if (sign == '\\') text += "\\\\";
    if (sign == '"') text += "\\\"";
    if (sign == '\n') text += "\\n";
    if (sign != '\\' && sign != '"' && sign != '\n') text += sign;
  }
}

}  // namespace

void TextFormat::family(std::string_view name, std::string_view type, std::string_view help) {
  name_ = name;
  fmt::format_to(std::back_inserter(text_), "# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help);
}

void TextFormat::begin(std::string_view ending, Labels labels, std::string_view le) {
  text_ += name_;
  text_ += ending;
  char before = '{';
  const auto append = [&](std::string_view label, std::string_view value) {
    text_ += before;
    text_ += label;
    text_ += "=\"";
    append_escaped(text_, value);
    text_ += '"';
    before = ',';
  };
  for (const auto& [label, value] : labels) append(label, value);
  if (!le.empty()) append("le", le);
  if (before == ',') text_ += '}';
  text_ += ' ';
}

void TextFormat::sample(Labels labels, std::uint64_t value) {
  begin("", labels, "");
  text_ += std::to_string(value) + '\n';
}

void TextFormat::sample(Labels labels, double value) {
  begin("", labels, "");
  text_ += number_text(value) + '\n';
}

void TextFormat::sample(Labels labels, const publish::DurationBuckets::Counts& counts) {
  const auto& bounds = publish::DurationBuckets::kBounds_ns;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < counts.count.size(); ++i) {
    sum += counts.count[i];
    begin("_bucket", labels, i < bounds.size() ? number_text(seconds(bounds[i])) : "+Inf");
    text_ += std::to_string(sum) + '\n';
  }
  begin("_sum", labels, "");
  text_ += number_text(static_cast<double>(counts.sum_ns) * 1e-9) + '\n';
  begin("_count", labels, "");
  text_ += std::to_string(sum) + '\n';
}

}  // namespace posed::metrics
