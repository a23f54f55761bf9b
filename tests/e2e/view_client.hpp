// The real `posed view` and a page in front of it: a WebSocket client that does what the page's
// script does. Every wait ends after `kPatience` at the latest.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "posed/v1/control.pb.h"
#include "tests/support/process.hpp"
#include "tests/support/raw_peer.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

// `posed view` for a daemon, with a page of two files.
class ViewProcess {
 public:
  ViewProcess(const std::string& connect, const std::string& control,
              std::vector<std::string> options = {}) {
    folder_.write("index.html", "<p>the page");
    folder_.write("page.js", "run()");
    std::vector<std::string> arguments{
        "view", "--connect", connect, "--port", "0", "--page", folder_.path().string(), "--json"};
    if (!control.empty()) arguments.insert(arguments.end(), {"--control", control});
    arguments.insert(arguments.end(), options.begin(), options.end());
    process = std::make_unique<Process>(std::move(arguments));
    const auto line = process->line();
    INFO(process->errors());
    REQUIRE(line);
    url = nlohmann::json::parse(*line).at("url");
    host = url.substr(7, url.find('/', 7) - 7);
    token = url.substr(url.find('=') + 1);
  }

  // The answer to an HTTP request whose first line and further headers are given.
  [[nodiscard]] std::string answer(const std::string& first_line,
                                   const std::string& headers = "") const {
    const RawPeer peer(host);
    if (!peer.send(first_line + " HTTP/1.1\r\nHost: " + host + "\r\n" + headers +
                   "Connection: close\r\n\r\n")) {
      return {};
    }
    return peer.receive(1'000'000);
  }
  [[nodiscard]] int status(const std::string& first_line, const std::string& headers = "") const {
    const std::string text = answer(first_line, headers);
    return text.size() < 12 ? 0 : std::atoi(text.substr(9, 3).c_str());
  }
  [[nodiscard]] double memory_MB() const {
    std::ifstream statm("/proc/" + std::to_string(process->pid()) + "/statm");
    double size = 0.0;
    double resident = 0.0;
    statm >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
  }

  std::unique_ptr<Process> process;
  std::string url, host, token;

 private:
  TempFolder folder_;
};

// A message of the bridge: one of the daemon's behind its topic, or a word in JSON (topic empty).
struct ViewMessage {
  std::string topic, body;
  [[nodiscard]] nlohmann::json word() const { return nlohmann::json::parse(body); }
};

class PageClient {
 public:
  static constexpr std::chrono::seconds kPatience{15};

  explicit PageClient(const ViewProcess& view)
      : PageClient(view, "http://" + view.host, view.token) {}
  PageClient(const ViewProcess& view, const std::string& origin, const std::string& token) {
    namespace beast = boost::beast;
    const auto port =
        static_cast<std::uint16_t>(std::atoi(view.host.substr(view.host.rfind(':') + 1).c_str()));
    beast::get_lowest_layer(socket_).socket().connect(
        {boost::asio::ip::make_address("127.0.0.1"), port});
    socket_.set_option(
        beast::websocket::stream_base::decorator([origin](beast::websocket::request_type& request) {
          request.set(beast::http::field::origin, origin);
        }));
    socket_.binary(true);
    wait(kPatience, [&](auto done) {
      socket_.async_handshake(response_, view.host, "/ws?token=" + token,
                              [this, done](const boost::system::error_code& error) {
                                is_open_ = !error;
                                done();
                              });
    });
  }

  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] unsigned refusal() const { return response_.result_int(); }

  void say(const std::string& word) { write(word, true); }
  void ready() { say(R"({"type":"ready"})"); }
  void ask(std::uint32_t number, const v1::ControlRequest& request) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
    write(bytes + request.SerializeAsString(), false);
  }
  void write(const std::string& bytes, bool text) {
    socket_.text(text);
    boost::system::error_code error;
    socket_.write(boost::asio::buffer(bytes), error);
    if (error) is_open_ = false;
  }
  // Any bytes below the WebSocket.
  void write_raw(const std::string& bytes) {
    boost::system::error_code error;
    boost::asio::write(boost::beast::get_lowest_layer(socket_).socket(), boost::asio::buffer(bytes),
                       error);
  }

  // The next message; empty when none comes in time, or at the end.
  std::optional<ViewMessage> next(std::chrono::milliseconds within = kPatience) {
    if (!reading_) {
      reading_ = true;
      socket_.async_read(buffer_, [this](const boost::system::error_code& error, std::size_t) {
        reading_ = false;
        has_read_ = !error;
        if (error) is_open_ = false;
      });
    }
    const auto end = std::chrono::steady_clock::now() + within;
    io_.restart();
    while (reading_ && std::chrono::steady_clock::now() < end) io_.run_one_until(end);
    if (!std::exchange(has_read_, false)) return std::nullopt;
    const auto* const data = static_cast<const char*>(buffer_.cdata().data());
    std::string bytes(data, buffer_.size());
    buffer_.consume(buffer_.size());
    if (socket_.got_text()) {
      const auto word = nlohmann::json::parse(bytes, nullptr, false);
      if (word.is_object() && word.contains("may_control")) may_control_ = word["may_control"];
      return ViewMessage{"", std::move(bytes)};
    }
    const auto length = static_cast<unsigned char>(bytes.front());
    return ViewMessage{bytes.substr(1, length), bytes.substr(1 + length)};
  }
  // The next message with this topic; others are skipped.
  std::optional<ViewMessage> next_of(const std::string& topic,
                                     std::chrono::milliseconds within = kPatience) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (std::chrono::steady_clock::now() < end) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      auto message = next(left);
      if (!message) return std::nullopt;
      if (message->topic == topic) return message;
    }
    return std::nullopt;
  }
  // The next word of that type.
  std::optional<nlohmann::json> next_word(const std::string& type,
                                          std::chrono::milliseconds within = kPatience) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (std::chrono::steady_clock::now() < end) {
      const auto message = next_of("", within);
      if (!message) return std::nullopt;
      if (message->word().at("type") == type) return message->word();
    }
    return std::nullopt;
  }
  // Waits until what the bridge said last is that the page may control, or may not.
  bool comes_to_control(bool may) {
    while (may_control_ != may) {
      if (!next_of("")) return false;
    }
    return true;
  }
  // The reply to a request; empty when none comes.
  std::optional<v1::ControlReply> reply(std::uint32_t number) {
    const auto message = next_of("reply/" + std::to_string(number));
    v1::ControlReply reply;
    if (!message || !reply.ParseFromString(message->body)) return std::nullopt;
    return reply;
  }

 private:
  template <typename Start>
  void wait(std::chrono::milliseconds within, Start&& start) {
    bool done = false;
    start([&done] { done = true; });
    const auto end = std::chrono::steady_clock::now() + within;
    io_.restart();
    while (!done && std::chrono::steady_clock::now() < end) io_.run_one_until(end);
  }

  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_{io_};
  boost::beast::websocket::response_type response_;
  boost::beast::flat_buffer buffer_;
  bool is_open_ = false, reading_ = false, has_read_ = false;
  std::optional<bool> may_control_;
};

}  // namespace posed::test
