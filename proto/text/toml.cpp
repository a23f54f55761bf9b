#include "proto/text/toml.hpp"

#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed {
namespace {

constexpr std::size_t kMaxDescription = 300;  // bytes; toml++ can repeat a whole key in its message

}  // namespace

Result<toml::table> parse_toml(std::string_view text, const std::string& file,
                               const TomlLimits& limits) {
  if (auto fits = check_toml(text, file, limits); !fits) return std::unexpected(fits.error());
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    return fail("not TOML: " + clean(error.description(), kMaxDescription) +
                    "; was the file cut off, or mistyped here?",
                file, static_cast<int>(error.source().begin.line));
  }
}

Result<toml::table> load_toml(const std::filesystem::path& path, const TomlLimits& limits) {
  const auto text = load_file(path, {.what = limits.what, .max_bytes = limits.bytes});
  if (!text) return std::unexpected(text.error());
  return parse_toml(*text, path.string(), limits);
}

}  // namespace posed
