// What the bridge answers to an HTTP request: which files there are, who gets the page, who may
// open the WebSocket, and what is refused. No socket; pure functions, so that tests and a fuzz
// target can try every request. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/http/exchange.hpp"
#include "proto/frame/result.hpp"

namespace posed::view {

// PageFiles: the files of the page, read into memory at the start, but for those of the camera.
// What the network names is only looked up in this list and never becomes a path. Does not change
// afterwards.
inline constexpr std::size_t kMaxPageFiles = 256;
inline constexpr std::size_t kMaxPageBytes = 64 * 1024 * 1024;  // of all files together

// The folder of what finds hands in a camera's picture. It is large and few people use it: its
// files are read when they are asked for. It is optional; pages without it may use no camera.
inline constexpr std::string_view kCameraFolder = "/camera/";

struct PageFile {
  std::string bytes;             // empty if it is read when it is asked for
  std::filesystem::path path{};  // of such a file
  std::string_view type;         // MIME type, by the extension
  std::string etag;              // with its quotes; changes when the bytes do
  // What was read of it, while an answer has it: many who ask at once share one copy.
  mutable std::weak_ptr<const std::string> read{};
};

class PageFiles {
 public:
  // Reads all regular files below `folder` whose names do not begin with a dot; links are not
  // followed. An Error says whether index.html is missing or there is too much in the folder.
  static Result<PageFiles> load(const std::filesystem::path& folder);

  // The file of a target without its query, such as "/page.js"; "/" is index.html. Null: there is
  // none. Valid as long as this object.
  [[nodiscard]] const PageFile* find(std::string_view path) const;
  [[nodiscard]] bool has_camera() const { return find("/camera/finder.js") != nullptr; }

 private:
  std::map<std::string, PageFile, std::less<>> files_;  // by "/name"
};

// The MIME type that browsers expect of a file of this name.
[[nodiscard]] std::string_view type_of_name(std::string_view name);

// What is served, and to whom.
struct Site {
  PageFiles files{};
  std::string token{};  // whoever knows it may see the streams
  // Of the page's own addresses (http::is_own_host).
  std::vector<std::string> hosts{};
};

[[nodiscard]] http::Answer answer_to(const http::Request& request, const Site& site);

// Headers of every answer: they forbid the browser to run, load, send or frame anything but the
// page itself. Only with `camera` may it open one and compile WebAssembly.
[[nodiscard]] std::vector<http::Header> safety_headers(std::string_view host, bool camera);

// 128 random bits as 22 characters for a URL.
[[nodiscard]] std::string random_token();

// The token in this file, so that a page that is open survives a restart of who serves it; made
// (mode 0600), where there is none that its user alone may read. Never fails: where nothing can be
// kept, the token is one for this time.
[[nodiscard]] std::string kept_token(const std::filesystem::path& file);

}  // namespace posed::view
