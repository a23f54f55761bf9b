// Findings: what a command found out, laid out once and rendered three times: as text for people,
// as JSON for programs (`--json`) and as tables of an HTML page (`--report`). Cold.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/tools/report/page.hpp"

namespace posed::tools {

struct Finding;

// An ordered list of findings, each a value with a name or a sentence. The functions that add
// return the list, so that they can be chained.
class Findings {
 public:
  using Scalar =
      std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string>;

  // Adds a bool, a number, a text, other findings, or a list of these. JSON shows the value under
  // `name`, which ends in the unit of a quantity; an empty optional and a number that is not finite
  // are null there. A real number is rounded to 12 digits (7 of a float), so that a computed 100 is
  // no 100.00000000000213. People see it only in a sentence. A name that is there already gets the
  // new value.
  template <typename T>
  Findings& add(std::string name, const T& value);
  // Adds every finding of `others`.
  Findings& add_all(const Findings& others);
  // Adds what a JSON object in a text holds; nothing of any other text.
  Findings& add_json(std::string_view text);

  // Adds a line for people, on stdout. The lines of a list's findings stand where the list does.
  Findings& say(std::string line);
  // Adds a sentence on stderr, after all that stdout shows, with --json too. A warning is a remark
  // that begins so.
  Findings& remark(std::string sentence);
  Findings& warn(const std::vector<std::string>& sentences);
  // Adds the remark that judges. Bad news makes the exit code of the command kFailed.
  Findings& verdict(std::string sentence, bool good);
  // Like verdict(), but printed first on stdout; with --json on stderr.
  Findings& headline(std::string sentence, bool good);

  // Adds the sentences on stderr of other findings, and whether their news are bad.
  Findings& take_sentences(const Findings& others);

  // The number of this name, if there is one.
  [[nodiscard]] std::optional<double> number(std::string_view name) const;
  // The JSON, indented by so many blanks a level; -1: on one line.
  [[nodiscard]] std::string json(int indent = -1) const;
  // Every number here and in the objects, "kernel.length_deg", as text; lists are left out.
  [[nodiscard]] std::vector<std::vector<std::string>> numbers() const;

  // Prints JSON or the lines on stdout, then the sentences on stderr. Returns the exit code.
  int show(bool as_json, int indent = 2) const;

  // The list itself, for the renderers.
  [[nodiscard]] const std::vector<Finding>& all() const { return list_; }
  // Whether this is a value in a list, which has no name.
  [[nodiscard]] bool is_bare_value() const;

 private:
  [[nodiscard]] static double rounded(double value, int digits);
  Findings& add_scalar(std::string name, Scalar value);
  Findings& add_object(std::string name, Findings findings);
  Findings& add_list(std::string name, std::vector<Findings> items);
  Findings& put(Finding finding);

  std::vector<Finding> list_;
  bool good_ = true;
};

struct Finding {
  enum class Kind : std::uint8_t { kScalar, kObject, kList, kHeadline, kLine, kRemark };
  Kind kind = Kind::kScalar;
  std::string text{};  // a value's name, or the sentence
  Findings::Scalar value{};
  std::vector<Findings> parts{};  // of an object the one, of a list its items

  [[nodiscard]] std::string json() const;  // the value on one line
};

template <typename T>
Findings& Findings::add(std::string name, const T& value) {
  if constexpr (std::is_same_v<T, Findings>) {
    return add_object(std::move(name), value);
  } else if constexpr (requires {
                         value.has_value();
                         *value;
                       }) {
    return value ? add(std::move(name), *value) : add_scalar(std::move(name), {});
  } else if constexpr (std::is_convertible_v<T, std::string_view>) {
    return add_scalar(std::move(name), std::string(std::string_view(value)));
  } else if constexpr (std::is_same_v<T, bool>) {
    return add_scalar(std::move(name), value);
  } else if constexpr (std::floating_point<T>) {
    return add_scalar(std::move(name), rounded(value, std::is_same_v<T, float> ? 7 : 12));
  } else if constexpr (std::signed_integral<T>) {
    return add_scalar(std::move(name), std::int64_t{value});
  } else if constexpr (std::unsigned_integral<T>) {
    return add_scalar(std::move(name), std::uint64_t{value});
  } else {
    std::vector<Findings> items;
    for (const auto& item : value) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(item)>, Findings>) {
        items.push_back(item);
      } else {
        items.push_back(Findings().add({}, item));  // without a name it is the value alone
      }
    }
    return add_list(std::move(name), std::move(items));
  }
}

// Adds a table of every number, where there are some, with a sentence that says what they are.
void add_numbers(const Findings& findings, const std::string& sentence, report::Page& page);
// Adds the JSON, folded away.
void add_json(const Findings& findings, report::Page& page);

}  // namespace posed::tools
