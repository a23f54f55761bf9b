#include "daemon/tools/view/request_rules.hpp"

#include <catch2/catch.hpp>

#include <filesystem>
#include <set>
#include <string>

#include "tests/support/temp_folder.hpp"

namespace posed::view {
namespace {

constexpr const char* kOwnHost = "127.0.0.1:5580";

// A site with the token "secret", a page and a script.
struct SiteRig {
  SiteRig() {
    folder.write("index.html", "<p>page");
    folder.write("page.js", "run()");
    folder.write(".hidden", "not of the page");
    std::filesystem::create_directory(folder.path() / "models");
    folder.write("models/mannequin.vrm", "glTF");
    std::filesystem::create_symlink("/etc/passwd", folder.path() / "link.txt");
    site.files = PageFiles::load(folder.path()).value();
  }
  [[nodiscard]] http::Answer get(std::string_view target) const {
    return answer_to({.method = "GET", .target = target, .host = kOwnHost}, site);
  }
  [[nodiscard]] http::Answer open(std::string_view target, std::string_view origin,
                                  std::string_view host = kOwnHost) const {
    return answer_to(
        {.method = "GET", .target = target, .host = host, .origin = origin, .upgrade = true}, site);
  }

  test::TempFolder folder;
  Site site{.token = "secret", .hosts = {kOwnHost, "localhost:5580"}};
};

TEST_CASE("only who knows the token gets the page") {
  const SiteRig rig;
  CHECK(rig.get("/?token=secret").body == "<p>page");
  CHECK(rig.get("/index.html?theme=dark&token=secret").status == 200);
  for (const char* target :
       {"/", "/?token=", "/?token=secre", "/?token=secrets", "/?token=Secret", "/?xtoken=secret",
        "/?token=wrong&token=secret", "/index.html", "/?token=secret#", "/?TOKEN=secret"}) {
    INFO(target);
    const http::Answer answer = rig.get(target);
    CHECK(answer.status == 403);
    CHECK(answer.body.find("posed prints") != std::string_view::npos);
  }
}

TEST_CASE("what the network names is looked up in the list of files, and nowhere else") {
  const SiteRig rig;
  CHECK(rig.get("/page.js").body == "run()");
  CHECK(rig.get("/page.js").type == "text/javascript; charset=utf-8");
  CHECK(rig.get("/models/mannequin.vrm").type == "model/gltf-binary");
  for (const char* target :
       {"/../page.js", "/models/../page.js", "//page.js", "/./page.js", "/%70age.js", "/.hidden",
        "/link.txt", "/..%2f..%2fetc/passwd", "/../../../../etc/passwd", "/etc/passwd", "",
        "page.js", "http://127.0.0.1:5580/page.js", "/models", "/models/", "/page.js/", "*"}) {
    INFO(target);
    CHECK(rig.get(target).status == 404);
  }
}

TEST_CASE("a camera may be used where its files are, which are read when they are asked for") {
  SiteRig rig;
  const auto headers = [&] {
    std::string all;
    for (const auto& header : safety_headers(kOwnHost, rig.site.files.has_camera())) {
      all += header.value + "\n";
    }
    return all;
  };
  CHECK(headers().find("wasm") == std::string::npos);
  CHECK(headers().find("camera=()") != std::string::npos);
  std::filesystem::create_directory(rig.folder.path() / "camera");
  rig.folder.write("camera/finder.js", "find()");
  rig.folder.write("camera/hands.wasm", "\1");
  rig.site.files = PageFiles::load(rig.folder.path()).value();
  CHECK(headers().find("script-src 'self' 'wasm-unsafe-eval';") != std::string::npos);
  CHECK(headers().find("camera=(self)") != std::string::npos);
  CHECK(rig.site.files.find("/camera/finder.js")->bytes.empty());
  {
    const http::Answer answer = rig.get("/camera/finder.js");
    CHECK(answer.body == "find()");
    CHECK(rig.get("/camera/finder.js").keeps == answer.keeps);  // many who ask share one copy
    CHECK(answer.keeps.use_count() == 1);
  }
  CHECK(rig.get("/camera/hands.wasm").type == "application/wasm");
  rig.folder.write("camera/finder.js", "other()");  // not what was there at the start
  CHECK(rig.get("/camera/finder.js").status == 404);
  CHECK(rig.get("/camera/../page.js").status == 404);
}

TEST_CASE("a file that the browser has is not sent again, and only GET and HEAD are answered") {
  const SiteRig rig;
  const http::Answer first = rig.get("/page.js");
  REQUIRE(first.status == 200);
  http::Request again{.method = "GET", .target = "/page.js", .host = kOwnHost};
  again.if_none_match = first.etag;
  CHECK(answer_to(again, rig.site).status == 304);
  again.if_none_match = "\"other\"";
  CHECK(answer_to(again, rig.site).status == 200);
  again.method = "HEAD";
  CHECK(answer_to(again, rig.site).status == 200);
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "get", ""}) {
    INFO(method);
    again.method = method;
    CHECK(answer_to(again, rig.site).status == 405);
  }
}

TEST_CASE("only the page itself opens the WebSocket, with its token") {
  const SiteRig rig;
  CHECK(rig.open("/ws?token=secret", "http://127.0.0.1:5580").upgrades());
  CHECK(rig.open("/ws?token=secret", "http://localhost:5580", "localhost:5580").upgrades());
  for (const char* origin :
       {"", "null", "http://evil.example", "https://127.0.0.1:5580", "http://127.0.0.1",
        "http://127.0.0.1:5581", "http://127.0.0.1:5580.evil.example", "http://localhost:5580",
        "http://127.0.0.1:5580/"}) {
    INFO(origin);
    CHECK(rig.open("/ws?token=secret", origin).status == 403);
  }
  for (const char* target : {"/ws", "/ws?token=", "/ws?token=wrong", "/ws?token=secretsecret"}) {
    INFO(target);
    CHECK(rig.open(target, "http://127.0.0.1:5580").status == 403);
  }
  CHECK(rig.open("/?token=secret", "http://127.0.0.1:5580").status == 404);
}

TEST_CASE("a name that somebody else points at this machine is refused") {
  SiteRig rig;
  for (const char* host : {"", "evil.example:5580", "127.0.0.1", "127.0.0.1:5581", "localhost"}) {
    INFO(host);
    http::Request request{.method = "GET", .target = "/page.js", .host = host};
    CHECK(answer_to(request, rig.site).status == 403);
    const std::string origin = std::string("http://") + host;
    CHECK(rig.open("/ws?token=secret", origin, host).status == 403);
  }
  rig.site.hosts.clear();  // it listens on all addresses
  CHECK(rig.open("/ws?token=secret", "http://10.0.0.7:5580", "10.0.0.7:5580").upgrades());
  CHECK(rig.open("/ws?token=secret", "http://10.0.0.8:5580", "10.0.0.7:5580").status == 403);
  CHECK(rig.open("/ws?token=secret", "http://a;b", "a;b").status == 403);
}

TEST_CASE("every answer forbids the browser what is not the page's own") {
  std::set<std::string_view> names;
  for (const http::Header& header : safety_headers(kOwnHost, false)) {
    names.insert(header.name);
    if (header.name != "Content-Security-Policy") continue;
    for (const char* part : {"default-src 'none'", "script-src 'self';", "style-src 'self';",
                             "ws://127.0.0.1:5580;", "frame-ancestors 'none'"}) {
      CHECK(header.value.find(part) != std::string::npos);
    }
    CHECK(header.value.find("unsafe") == std::string::npos);
  }
  CHECK(names.contains("Content-Security-Policy"));
  CHECK(names.contains("Referrer-Policy"));
  CHECK(names.contains("X-Content-Type-Options"));
  // A host cannot add words of its own.
  CHECK(safety_headers("a; script-src *", true).front().value.find('*') == std::string::npos);
}

TEST_CASE("tokens are long and differ") {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(random_token());
  CHECK(tokens.size() == 100);
  for (const std::string& token : tokens) {
    CHECK(token.size() == 22);
    CHECK(token.find_first_of("+/=&?#") == std::string::npos);
  }
}

TEST_CASE("a kept token outlives who serves the page, unless others could know it") {
  const test::TempFolder folder;
  const auto file = folder.path() / "page.token";
  const std::string token = kept_token(file);
  CHECK(token.size() == 22);
  CHECK(kept_token(file) == token);
  CHECK(std::filesystem::status(file).permissions() == std::filesystem::perms(0600));
  std::filesystem::permissions(file, std::filesystem::perms(0644));
  CHECK(kept_token(file) != token);
  const auto link = folder.path() / "link.token";
  std::filesystem::create_symlink(file, link);
  CHECK(kept_token(link) != kept_token(file));
  CHECK(kept_token(folder.path() / "missing" / "page.token").size() == 22);
}

TEST_CASE("a folder without a page, and one that is none of a page, are errors") {
  const test::TempFolder folder;
  CHECK(PageFiles::load(folder.path()).error().message.contains("./run page"));
  CHECK_FALSE(PageFiles::load(folder.path() / "none"));
  folder.write("index.html", "");
  CHECK(PageFiles::load(folder.path()));
  for (std::size_t i = 0; i < kMaxPageFiles; ++i) folder.write(std::to_string(i) + ".js", "");
  CHECK(PageFiles::load(folder.path()).error().message.contains("more than 256 files"));
}

}  // namespace
}  // namespace posed::view
