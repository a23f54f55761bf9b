// parse_model on any bytes. The header's checksum rejects nearly all of them, so each input is also
// tested as the payload of a valid header.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>

#include "models/style/model/style_model.hpp"
#include "tests/fuzz/model_envelope.hpp"

namespace {

void try_bytes(const std::string& bytes) {
  const auto model = posed::style::parse_model(std::as_bytes(std::span(bytes)), "fuzz");
  if (!model) return;
  // An accepted model can be written and read back with the same bytes.
  const std::string written = posed::style::serialize_model(*model);
  const auto again = posed::style::parse_model(std::as_bytes(std::span(written)), "fuzz");
  if (!again || posed::style::serialize_model(*again) != written) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  try_bytes(input);
  try_bytes(posed::fuzz::as_model_file(input));
  return 0;
}
