// ParameterTable: the parameters of a stage, a row each. A row holds the parameter's spec and says
// where its value is kept. The specs of the StageType, the options that a stage is made with, and
// Stage::set() and state() follow from the rows, so that a further parameter is a field of the
// options and a row:
//
//   Table::row<&Options::limit_m>({.name = "limit_m", .help = "...", .max = 0.5, .live = true})
//
// Build a table once, cold; it is const afterwards.
#pragma once

#include <cassert>
#include <cstddef>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "models/stage.hpp"
#include "proto/text/parameter.hpp"

namespace posed {

// `Options` has a field for each value; a new object holds the defaults. `Owner` is the stage that
// keeps the options while it runs.
template <typename Options, typename Owner>
class ParameterTable {
 public:
  // What the stage itself does about a live parameter. Both functions are RT-safe.
  struct Live {
    void (Owner::*set)(double value) noexcept = nullptr;        // called before the field changes
    ParameterState (Owner::*state)() const noexcept = nullptr;  // null: the field, settled
  };

  struct Row {
    ParameterSpec spec{};
    // Keeps a text of the config; null for a number, and where the options do not keep the text.
    void (*read)(Options& options, const std::string& text) = nullptr;
    // The field as a number (posed::number_of); null for text without words.
    void (*assign)(Options& options, double number) noexcept = nullptr;
    double (*number)(const Options& options) noexcept = nullptr;
    Live live{};
  };

  explicit ParameterTable(std::vector<Row> rows) : rows_(std::move(rows)) {}

  // The row of a parameter that is kept in `Field`: a pointer to a member of the options, or a
  // function that returns a reference to one. The field's default is the parameter's. A field of an
  // enum belongs to a text whose `words` are in the order of the enum.
  template <auto Field>
  [[nodiscard]] static Row row(ParameterSpec spec, Live live = {}) {
    using Value = std::remove_cvref_t<std::invoke_result_t<decltype(Field), Options&>>;
    Options defaults;
    Row row{.live = live};
    if constexpr (std::is_same_v<Value, std::string>) {
      spec.default_value = std::invoke(Field, defaults);
      row.read = [](Options& options, const std::string& text) {
        std::invoke(Field, options) = text;
      };
    } else {
      spec.default_value = default_of(std::invoke(Field, defaults), spec);
      row.assign = [](Options& options, double number) noexcept {
        if constexpr (std::is_enum_v<Value>) {
          std::invoke(Field, options) = static_cast<Value>(static_cast<int>(number));
        } else {
          std::invoke(Field, options) = static_cast<Value>(number);
        }
      };
      row.number = [](const Options& options) noexcept {
        return static_cast<double>(std::invoke(Field, options));
      };
    }
    row.spec = std::move(spec);
    return row;
  }

  [[nodiscard]] std::vector<ParameterSpec> specs() const {
    std::vector<ParameterSpec> specs;
    specs.reserve(rows_.size());
    for (const Row& row : rows_) specs.push_back(row.spec);
    return specs;
  }

  // The options of complete parameters.
  [[nodiscard]] Options options(const Parameters& parameters) const {
    Options options;
    for (const Row& row : rows_) {
      const ParameterValue& value = parameters.at(std::string(row.spec.name));
      if (row.read != nullptr) row.read(options, std::get<std::string>(value));
      if (row.assign != nullptr) row.assign(options, number_of(row.spec, value));
    }
    return options;
  }

  // What Stage::set() does: `index` is that of a live number in specs().
  RT_SAFE void set(Owner& owner, Options& options, std::size_t index,
                   double number) const noexcept {
    assert(index < rows_.size() && rows_[index].assign != nullptr);
    const Row& row = rows_[index];
    if (row.live.set != nullptr) (owner.*row.live.set)(number);
    row.assign(options, number);
  }

  // What Stage::state() does.
  RT_SAFE [[nodiscard]] ParameterState state(const Owner& owner, const Options& options,
                                             std::size_t index) const noexcept {
    assert(index < rows_.size() && rows_[index].number != nullptr);
    const Row& row = rows_[index];
    if (row.live.state != nullptr) return (owner.*row.live.state)();
    const double number = row.number(options);
    return {.now = number, .target = number};
  }

 private:
  template <typename Value>
  [[nodiscard]] static ParameterValue default_of(const Value& value, const ParameterSpec& spec) {
    if constexpr (std::is_enum_v<Value>) {
      return std::string(spec.words[static_cast<std::size_t>(value)]);
    } else if constexpr (std::is_same_v<Value, int>) {
      return std::int64_t{value};
    } else {
      return value;
    }
  }

  std::vector<Row> rows_;
};

}  // namespace posed
