#include "daemon/tools/view/request_rules.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>

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
    std::string name = "/" + at->path().lexically_relative(folder).generic_string();
    const bool on_demand = name.starts_with(kCameraFolder);
    auto read =
        TRY(load_file(at->path(), {.what = "file of the page", .max_bytes = kMaxPageBytes}));
    bytes += read.size();
    if (page.files_.size() == kMaxPageFiles || bytes > kMaxPageBytes) {
      return fail(fmt::format("the folder of the page has more than {} files or {} MB; name the"
                              " folder that `./run page` makes",
                              kMaxPageFiles, kMaxPageBytes / (1024 * 1024)),
                  folder.string());
    }
    const std::string_view type = type_of_name(name);
    PageFile file{.bytes = {}, .path = {}, .type = type, .etag = etag_of(read)};
    if (on_demand) {
      file.path = at->path();
    } else {
      file.bytes = std::move(read);
    }
    page.files_.emplace(std::move(name), std::move(file));
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

namespace {

constexpr std::size_t kTokenBytes = 16;
constexpr std::size_t kTokenText = 22;  // of base64 without padding

constexpr std::string_view kWithoutToken = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><title>posed: no access</title>
<h1>This page needs its whole address</h1>
<p>posed prints it in the terminal: <code>http://.../?token=...</code>. Open that one; each start
of <code>posed view</code> has a new token.</p></html>
)";

// In a time that does not depend on where the two differ.
bool same_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

// "token" of "/?a=b&token=T"; empty without one.
std::string_view token_of(std::string_view target) {
  constexpr std::string_view kName = "token=";
  auto at = target.find('?');
  while (at != std::string_view::npos) {
    target.remove_prefix(at + 1);
    at = target.find('&');
    const std::string_view part = target.substr(0, at);
    if (part.starts_with(kName)) return part.substr(kName.size());
  }
  return {};
}

// A browser says in `Origin` which page opens a WebSocket, and no page can change that.
bool is_own_origin(const http::Request& request) {
  constexpr std::string_view kScheme = "http://";
  return request.origin.starts_with(kScheme) &&
         request.origin.substr(kScheme.size()) == request.host;
}

http::Answer answer_to_upgrade(const http::Request& request, const Site& site,
                               std::string_view path) {
  if (path != "/ws") return http::refuse(404, "the WebSocket is /ws\n");
  if (!is_own_origin(request))
    return http::refuse(403, "another page may not open this WebSocket\n");
  if (!same_secret(token_of(request.target), site.token)) {
    return http::refuse(403, "the token is wrong: open the URL that posed printed\n");
  }
  return {.status = 101};
}

// The bytes belong to the answers. The file has been there at the start.
http::Answer answer_on_demand(const PageFile& file) {
  auto bytes = file.read.lock();
  if (!bytes) {
    auto read = load_file(file.path, {.what = "file of the page", .max_bytes = kMaxPageBytes});
    if (!read || etag_of(*read) != file.etag) {
      return http::refuse(404, "this file has changed: start posed view again\n");
    }
    bytes = std::make_shared<const std::string>(std::move(*read));
    file.read = bytes;
  }
  return {.body = *bytes, .type = file.type, .etag = file.etag, .keeps = bytes};
}

}  // namespace

http::Answer answer_to(const http::Request& request, const Site& site) {
  if (!http::is_own_host(request.host, site.hosts)) {
    return http::refuse(403, "this name is not the bridge's: open the URL that posed printed\n");
  }
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  if (request.upgrade) return answer_to_upgrade(request, site, path);
  if (request.method != "GET" && request.method != "HEAD") {
    return http::refuse(405, "only GET and HEAD\n");
  }
  const PageFile* const file = site.files.find(path);
  if (file == nullptr) return http::refuse(404, "there is no such file\n");
  const bool is_page = file == site.files.find("/");
  if (is_page && !same_secret(token_of(request.target), site.token)) {
    return {.status = 403, .body = kWithoutToken, .type = type_of_name(".html")};
  }
  if (request.if_none_match == file->etag) {
    return {.status = 304, .type = file->type, .etag = file->etag};
  }
  if (!file->path.empty()) return answer_on_demand(*file);
  return {.body = file->bytes, .type = file->type, .etag = file->etag};
}

std::vector<http::Header> safety_headers(std::string_view host, bool camera) {
  // three.js reads the textures of a model from blob: addresses, which the page makes itself. Older
  // browsers do not count the WebSocket as 'self'.
  const std::string socket = http::is_host(host) ? " ws://" + std::string(host) : "";
  return {
      {"Content-Security-Policy",
       "default-src 'none'; script-src 'self'" + std::string(camera ? " 'wasm-unsafe-eval'" : "") +
           "; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob: data:" +
           socket + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
      {"Permissions-Policy", camera ? "camera=(self)" : "camera=()"},
      {"X-Content-Type-Options", "nosniff"},
      {"X-Frame-Options", "DENY"},
      // The token is part of the page's URL.
      {"Referrer-Policy", "no-referrer"},
      {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Cross-Origin-Opener-Policy", "same-origin"}};
}

std::string random_token() {
  if (sodium_init() < 0) std::abort();  // the system has no random numbers
  std::array<unsigned char, kTokenBytes> bits{};
  randombytes_buf(bits.data(), bits.size());
  constexpr int kUrl = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
  std::array<char, sodium_base64_ENCODED_LEN(kTokenBytes, kUrl)> text{};
  sodium_bin2base64(text.data(), text.size(), bits.data(), bits.size(), kUrl);
  return text.data();
}

namespace {

// Empty: there is none, or others could know it.
std::string read_token(const std::filesystem::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) return {};
  struct stat about{};
  std::array<char, kTokenText + 1> text{};
  const bool own = fstat(fd, &about) == 0 && S_ISREG(about.st_mode) && about.st_uid == geteuid() &&
                   (about.st_mode & 077) == 0;
  const ssize_t size = own ? read(fd, text.data(), text.size()) : 0;
  close(fd);
  if (size != ssize_t{kTokenText}) return {};
  const bool is_token = std::all_of(text.begin(), text.begin() + kTokenText, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  return is_token ? std::string(text.data(), kTokenText) : std::string();
}

}  // namespace

std::string kept_token(const std::filesystem::path& file) {
  if (std::string kept = read_token(file); !kept.empty()) return kept;
  std::string token = random_token();
  unlink(file.c_str());
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) return token;
  const bool written = write(fd, token.data(), token.size()) == std::ssize(token);
  close(fd);
  if (!written) unlink(file.c_str());
  return token;
}

}  // namespace posed::view
