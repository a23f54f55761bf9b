#include "proto/frame/result.hpp"

#include <system_error>

#include "proto/text/clean.hpp"

namespace posed {
namespace {

constexpr std::size_t kMaxPathBytes = 4096;  // longest path in Linux

}  // namespace

std::string Error::text() const {
  std::string sentence = clean(message);
  if (file.empty()) return sentence;
  const std::string place = clean(file, kMaxPathBytes);
  if (line == 0) return place + ": " + sentence;
  return place + ":" + std::to_string(line) + ": " + sentence;
}

std::string errno_text(int error) {
  return std::error_code(error, std::generic_category()).message();
}

}  // namespace posed
