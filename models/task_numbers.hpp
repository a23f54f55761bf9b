// Values as the plain numbers of a task's result, and back in the same order. Cold.
#pragma once

#include <cassert>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "models/tasks.hpp"

namespace posed {

class NumberWriter {
 public:
  NumberWriter& add(double number) {
    numbers_.push_back(number);
    return *this;
  }
  // A matrix or a vector, with its size.
  NumberWriter& add(const Eigen::MatrixXd& values) {
    add(static_cast<double>(values.rows())).add(static_cast<double>(values.cols()));
    numbers_.insert(numbers_.end(), values.data(), values.data() + values.size());
    return *this;
  }
  NumberWriter& add(std::string_view text) {
    add(static_cast<double>(text.size()));
    numbers_.insert(numbers_.end(), text.begin(), text.end());
    return *this;
  }
  [[nodiscard]] TaskResult take() { return std::move(numbers_); }

 private:
  TaskResult numbers_;
};

class NumberReader {
 public:
  // The numbers outlive the reader.
  explicit NumberReader(const TaskResult& numbers) : next_(numbers.data()), left_(numbers.size()) {}

  [[nodiscard]] bool at_end() const { return left_ == 0; }
  [[nodiscard]] double number() {
    assert(left_ > 0);
    --left_;
    return *next_++;
  }
  [[nodiscard]] Eigen::Index index() { return static_cast<Eigen::Index>(number()); }
  [[nodiscard]] Eigen::MatrixXd matrix() {
    const Eigen::Index rows = index();
    const Eigen::Index cols = index();
    const std::size_t size = rows * cols;
    assert(left_ >= size);
    const double* const values = next_;
    next_ += size;
    left_ -= size;
    return Eigen::Map<const Eigen::MatrixXd>(values, rows, cols);
  }
  [[nodiscard]] Eigen::VectorXd vector() { return matrix(); }
  [[nodiscard]] std::string text() {
    std::string out(static_cast<std::size_t>(number()), '\0');
    for (char& c : out) c = static_cast<char>(number());
    return out;
  }

 private:
  const double* next_;
  std::size_t left_;
};

}  // namespace posed
