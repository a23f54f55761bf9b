// Any bytes at the page's port: as an HTTP request for the rules, and as messages of a page for the
// hub. Nobody without the token gets the page or the WebSocket, nothing but the allowed requests
// reaches the daemon, and what waits for a page is bounded.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include "daemon/http/session.hpp"
#include "daemon/tools/view/hub.hpp"
#include "daemon/tools/view/request_rules.hpp"

namespace {

using namespace posed::view;

constexpr std::string_view kToken = "0123456789abcdefghijkl";

const Site& site() {
  static const Site made = [] {
    std::string folder = (std::filesystem::temp_directory_path() / "fuzz_view_XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) std::abort();
    for (const char* name : {"/index.html", "/page.js"}) std::ofstream(folder + name) << name;
    Site made_site{.files = PageFiles::load(folder).value(),
                   .token = std::string(kToken),
                   .hosts = {"127.0.0.1:5580"}};
    std::filesystem::remove_all(folder);
    return made_site;
  }();
  return made;
}

void check_request(std::string_view bytes) {
  namespace beast_http = boost::beast::http;
  beast_http::request_parser<beast_http::empty_body> parser;
  boost::beast::error_code error;
  parser.header_limit(8 * 1024);
  parser.put(boost::asio::buffer(bytes.data(), bytes.size()), error);
  if (error || !parser.is_header_done()) return;
  const posed::http::Request request = posed::http::parts_of(parser.get());
  const posed::http::Answer answer = answer_to(request, site());
  const bool knows = request.target.find(kToken) != std::string_view::npos;
  const bool is_page = answer.status == 200 && answer.body == "/index.html";
  if ((is_page || answer.upgrades()) && (!knows || request.host != "127.0.0.1:5580")) std::abort();
  if (answer.upgrades() && request.origin != "http://127.0.0.1:5580") std::abort();
  for (const posed::http::Header& header : safety_headers(request.host, true)) {
    if (header.value.find_first_of("\r\n") != std::string::npos) std::abort();
  }
}

// Pieces of the input as messages: a byte with the kind and a byte with the length before each.
void check_messages(std::string_view bytes) {
  std::uint64_t last_ticket = 0;
  Hub hub({}, [&](std::uint64_t ticket, std::string_view request) {
    posed::v1::ControlRequest passed;
    if (!passed.ParseFromArray(request.data(), static_cast<int>(request.size()))) std::abort();
    if (passed.has_stop() || passed.has_haptics()) std::abort();
    if (passed.request_case() == posed::v1::ControlRequest::REQUEST_NOT_SET) std::abort();
    last_ticket = ticket;
    return true;
  });
  Tab tab;
  tab.wake = [] {};
  hub.control_is({.may = true, .reason = ""});
  hub.join(tab);
  std::int64_t now_ns = 0;
  while (bytes.size() >= 2) {
    const int kind = bytes[0];
    const std::string_view piece = bytes.substr(2, static_cast<unsigned char>(bytes[1]));
    bytes.remove_prefix(2 + piece.size());
    const auto middle = piece.size() / 2;
    now_ns += 100'000'000;
    if (kind % 5 == 0) hub.handle(tab, piece, true, now_ns);
    if (kind % 5 == 1) hub.handle(tab, piece, false, now_ns);
    if (kind % 5 == 2) hub.receive(piece.substr(0, middle), piece.substr(middle), now_ns);
    if (kind % 5 == 3) hub.replied(last_ticket, piece);
    if (kind % 5 == 4) hub.expire(now_ns);
  }
  if (tab.under_way > kMaxUnderWay) std::abort();
  std::size_t waiting = 0;
  while (tab.outbox.next()) ++waiting;
  if (waiting > kMaxAnswers + kMaxEvents + 3 * kMaxViewStreams + 1) std::abort();
  hub.leave(tab);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  check_request(bytes);
  check_messages(bytes);
  return 0;
}
