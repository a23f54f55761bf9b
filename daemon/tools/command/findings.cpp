#include "daemon/tools/command/findings.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstdio>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/frame/result.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"
#include "proto/text/number.hpp"

namespace posed::tools {
namespace {

using nlohmann::ordered_json;
using Kind = Finding::Kind;

bool has_value(const Finding& finding) { return finding.kind <= Kind::kList; }

ordered_json json_of(const Findings& findings);

ordered_json json_of(const Finding& finding) {
  assert(finding.kind != Kind::kObject || finding.parts.size() == 1);
  if (finding.kind == Kind::kObject) return json_of(finding.parts.front());
  if (finding.kind == Kind::kList) {
    ordered_json list = ordered_json::array();
    for (const Findings& item : finding.parts) list.push_back(json_of(item));
    return list;
  }
  return std::visit(
      [](const auto& value) -> ordered_json {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, std::monostate>) {
          return nullptr;
        } else {
          return value;
        }
      },
      finding.value);
}

ordered_json json_of(const Findings& findings) {
  if (findings.is_bare_value()) return json_of(findings.all().front());
  ordered_json object = ordered_json::object();
  for (const Finding& finding : findings.all()) {
    if (has_value(finding)) object[finding.text] = json_of(finding);
  }
  return object;
}

// A bare value where the JSON is no object.
Findings findings_of(const ordered_json& json, const std::string& name = {}) {
  Findings out;
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      if (value.is_object()) {
        out.add(key, findings_of(value));
      } else {
        out.add_all(findings_of(value, key));
      }
    }
  } else if (json.is_array()) {
    std::vector<Findings> items;
    for (const ordered_json& item : json) items.push_back(findings_of(item));
    out.add(name, items);
  } else if (json.is_boolean()) {
    out.add(name, json == true);
  } else if (json.is_number_unsigned()) {
    out.add(name, static_cast<std::uint64_t>(json));
  } else if (json.is_number_integer()) {
    out.add(name, static_cast<std::int64_t>(json));
  } else if (json.is_number()) {
    out.add(name, static_cast<double>(json));
  } else if (json.is_string()) {
    out.add(name, static_cast<std::string>(json));
  } else {
    out.add(name, std::optional<bool>());
  }
  return out;
}

std::optional<double> number_of(const Finding& finding) {
  if (finding.kind != Kind::kScalar) return std::nullopt;
  return std::visit(
      [](const auto& value) -> std::optional<double> {
        using T = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<T, bool> || !std::is_arithmetic_v<T>) {
          return std::nullopt;
        } else {
          return static_cast<double>(value);
        }
      },
      finding.value);
}

// Calls `each(name, finding)` for every number, with the names of the objects that it is in.
template <typename Each>
void for_each_number(const Findings& findings, const std::string& prefix, const Each& each) {
  for (const Finding& finding : findings.all()) {
    if (finding.kind == Kind::kObject) {
      for_each_number(finding.parts.front(), prefix + finding.text + ".", each);
    } else if (number_of(finding)) {
      each(prefix + finding.text, finding);
    }
  }
}

void print_lines(const Findings& findings) {
  for (const Finding& finding : findings.all()) {
    if (finding.kind == Kind::kLine) std::printf("%s\n", finding.text.c_str());
    for (const Findings& part : finding.parts) print_lines(part);
  }
}

}  // namespace

Findings& Findings::put(Finding finding) {
  const auto same = std::ranges::find_if(list_, [&](const Finding& other) {
    return has_value(finding) && has_value(other) && other.text == finding.text;
  });
  if (same != list_.end()) {
    *same = std::move(finding);
  } else {
    list_.push_back(std::move(finding));
  }
  return *this;
}

double Findings::rounded(double value, int digits) {
  std::array<char, 32> text{};
  char* const begin = text.data();
  const auto end =
      std::to_chars(begin, begin + text.size(), value, std::chars_format::general, digits).ptr;
  return exact_number<double>({begin, end}).value_or(value);  // nan and inf are no numbers
}

Findings& Findings::add_scalar(std::string name, Scalar value) {
  return put({.text = std::move(name), .value = std::move(value)});
}

Findings& Findings::add_object(std::string name, Findings findings) {
  return put({.kind = Kind::kObject, .text = std::move(name), .parts = {std::move(findings)}});
}

Findings& Findings::add_list(std::string name, std::vector<Findings> items) {
  return put({.kind = Kind::kList, .text = std::move(name), .parts = std::move(items)});
}

Findings& Findings::add_all(const Findings& others) {
  for (const Finding& finding : others.list_) put(finding);
  good_ = good_ && others.good_;
  return *this;
}

Findings& Findings::add_json(std::string_view text) {
  const ordered_json json = ordered_json::parse(text, nullptr, false);
  return json.is_object() ? add_all(findings_of(json)) : *this;
}

Findings& Findings::say(std::string line) {
  return put({.kind = Kind::kLine, .text = std::move(line)});
}

Findings& Findings::remark(std::string sentence) {
  return put({.kind = Kind::kRemark, .text = std::move(sentence)});
}

Findings& Findings::warn(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) remark("warning: " + sentence);
  return *this;
}

Findings& Findings::verdict(std::string sentence, bool good) {
  good_ = good_ && good;
  return remark(std::move(sentence));
}

Findings& Findings::headline(std::string sentence, bool good) {
  good_ = good_ && good;
  return put({.kind = Finding::Kind::kHeadline, .text = std::move(sentence)});
}

Findings& Findings::take_sentences(const Findings& others) {
  for (const Finding& finding : others.list_) {
    if (finding.kind == Kind::kRemark) put(finding);
  }
  good_ = good_ && others.good_;
  return *this;
}

std::optional<double> Findings::number(std::string_view name) const {
  for (const Finding& finding : list_) {
    if (finding.text == name) return number_of(finding);
  }
  return std::nullopt;
}

std::string Finding::json() const { return json_text(json_of(*this)); }

std::string Findings::json(int indent) const { return json_text(json_of(*this), indent); }

std::vector<std::vector<std::string>> Findings::numbers() const {
  std::vector<std::vector<std::string>> rows;
  for_each_number(*this, "", [&](const std::string& name, const Finding& finding) {
    const auto* const real = std::get_if<double>(&finding.value);
    rows.push_back({name, real != nullptr ? fmt::format("{:.5g}", *real) : finding.json()});
  });
  return rows;
}

int Findings::show(bool as_json, int indent) const {
  if (as_json) {
    std::printf("%s\n", json(indent).c_str());
  } else {
    for (const Finding& finding : list_) {
      if (finding.kind == Kind::kHeadline) std::printf("%s\n", finding.text.c_str());
    }
    print_lines(*this);
  }
  std::fflush(stdout);
  for (const Finding& finding : list_) {
    const bool headline = finding.kind == Kind::kHeadline && as_json;
    if (finding.kind == Kind::kRemark || headline) {
      std::fprintf(stderr, "posed: %s\n", clean(finding.text).c_str());
    }
  }
  return static_cast<int>(good_ ? ExitCode::kDone : ExitCode::kFailed);
}

bool Findings::is_bare_value() const {
  return !list_.empty() && has_value(list_.front()) && list_.front().text.empty();
}

void add_numbers(const Findings& findings, const std::string& sentence, report::Page& page) {
  report::Table table{.columns = {{"name", false}, {"value"}}, .rows = findings.numbers()};
  if (table.rows.empty()) return;
  page.section("Numbers");
  page.add({.title = "Every number",
            .sentence = sentence,
            .drawings = {},
            .tables = {std::move(table)}});
}

void add_json(const Findings& findings, report::Page& page) {
  page.text("The same as --json prints it", "For programs, and to copy from.", findings.json(2));
}

}  // namespace posed::tools
