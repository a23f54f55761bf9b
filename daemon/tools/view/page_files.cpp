#include "daemon/tools/view/page_files.hpp"

#include <array>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include "proto/text/load_file.hpp"

namespace posed::view {
namespace {

namespace fs = std::filesystem;

std::string etag_of(const std::string& bytes) {
  const auto sum = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return fmt::format("\"{:08x}-{:x}\"", sum, bytes.size());
}

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

}  // namespace

std::string_view type_of_name(std::string_view name) {
  constexpr auto kTypes = std::to_array<std::pair<std::string_view, std::string_view>>({
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
      {".glb", "model/gltf-binary"},
      {".vrm", "model/gltf-binary"},
  });
  for (const auto& [extension, type] : kTypes) {
    if (name.ends_with(extension)) return type;
  }
  return "application/octet-stream";
}

Result<PageFiles> PageFiles::load(const fs::path& folder) {
  PageFiles page;
  std::size_t bytes = 0;
  std::error_code error;
  fs::recursive_directory_iterator at(folder, error);
  for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) {
    if (is_hidden(at->path())) {
      at.disable_recursion_pending();
      continue;
    }
    std::error_code gone;  // since the folder was listed
    if (at->is_symlink(gone) || !at->is_regular_file(gone)) continue;
    auto read = load_file(at->path(), {.what = "file of the page", .max_bytes = kMaxPageBytes});
    if (!read) return std::unexpected(read.error());
    bytes += read->size();
    if (page.files_.size() == kMaxPageFiles || bytes > kMaxPageBytes) {
      return fail(fmt::format("the folder of the page has more than {} files or {} MB; name the"
                              " folder that `./run page` makes",
                              kMaxPageFiles, kMaxPageBytes / (1024 * 1024)),
                  folder.string());
    }
    std::string name = "/" + at->path().lexically_relative(folder).generic_string();
    const std::string_view type = type_of_name(name);
    std::string etag = etag_of(*read);
    page.files_.emplace(std::move(name), PageFile{std::move(*read), type, std::move(etag)});
  }
  if (error) return fail("the folder of the page cannot be read: " + error.message(), folder);
  if (page.find("/") == nullptr) {
    return fail("there is no index.html here; `./run page` builds the page", folder.string());
  }
  return page;
}

const PageFile* PageFiles::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace posed::view
