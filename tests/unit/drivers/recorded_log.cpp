#include "tests/unit/drivers/recorded_log.hpp"

#include <array>
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {
namespace {

constexpr double kTolerance = 1e-5;  // radians or metres, as for all committed goldens

std::vector<std::byte> hex_bytes(std::istream& words) {
  std::vector<std::byte> bytes;
  for (unsigned value = 0; words >> std::hex >> value;) {
    bytes.push_back(static_cast<std::byte>(value));
  }
  return bytes;
}

std::string rest_of(std::istream& words) {
  std::string rest;
  if (words.peek() == ' ') words.get();
  std::getline(words, rest);
  return rest;
}

void add_numbers(std::string& line, std::span<const float> values) {
  for (const float value : values) {
    std::array<char, 32> text{};
    (void)std::snprintf(text.data(), text.size(), " %.7f", static_cast<double>(value));
    line += text.data();
  }
}

std::string line_of(const Frame& frame) {
  std::string line = "frame " + std::to_string(frame.header.device_ns) + " root";
  add_numbers(line, frame.root_position_m);
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    line += frame.valid[j] ? " joint" : " missing";
    add_numbers(line, frame.rotation_xyzw[j]);
  }
  return line + '\n';
}

std::string line_of(const Sample& sample) {
  std::string line = "sample " + std::to_string(sample.header.device_ns);
  for (std::size_t i = 0; i < sample.value_count; ++i) {
    line += sample.valid[i] ? " value" : " missing";
    add_numbers(line, {&sample.value[i], 1});
  }
  return line + '\n';
}

std::string use_bodies(const drivers::Driver& driver, std::span<const std::byte> description,
                       drivers::Decoder& decoder,
                       std::vector<std::unique_ptr<const drivers::SourceLayout>>& layouts) {
  REQUIRE(driver.make_layout != nullptr);
  auto layout = driver.make_layout(description);
  if (!layout) FAIL(layout.error().text());
  std::string line = "bodies";
  for (const drivers::Body& body : (*layout)->bodies) {
    line += " '" + body.name + "' " + std::to_string(body.skeleton->joints.size());
  }
  decoder.use(**layout);
  layouts.push_back(std::move(*layout));
  return line + '\n';
}

bool same_word(const std::string& a, const std::string& b) {
  if (a == b) return true;
  char* end_a = nullptr;
  char* end_b = nullptr;
  const double x = std::strtod(a.c_str(), &end_a);
  const double y = std::strtod(b.c_str(), &end_b);
  const bool numbers = !a.empty() && !b.empty() && *end_a == '\0' && *end_b == '\0';
  return numbers && std::abs(x - y) <= kTolerance;
}

bool same_line(const std::string& a, const std::string& b) {
  std::istringstream words_a(a);
  std::istringstream words_b(b);
  std::string word_a;
  std::string word_b;
  for (;;) {
    const bool more_a = static_cast<bool>(words_a >> word_a);
    const bool more_b = static_cast<bool>(words_b >> word_b);
    if (!more_a || !more_b) return more_a == more_b;
    if (!same_word(word_a, word_b)) return false;
  }
}

}  // namespace

std::string recorded_row(std::int64_t at_ns, std::string_view form,
                         std::span<const std::byte> bytes) {
  std::string line = "at " + std::to_string(at_ns) + ' ' + std::string(form);
  for (const std::byte byte : bytes) {
    std::array<char, 8> hex{};
    (void)std::snprintf(hex.data(), hex.size(), " %02x", std::to_integer<unsigned>(byte));
    line += hex.data();
  }
  return line + '\n';
}

RecordedLog read_recorded_log(const std::filesystem::path& path) {
  RecordedLog log;
  std::ifstream file(path);
  bool first_text = true;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "driver") {
      log.driver = rest_of(words);
    } else if (key == "identity") {
      log.identity = rest_of(words);
    } else if (key == "text") {
      log.text += (first_text ? "" : "\n") + rest_of(words);
      first_text = false;
    } else {
      INFO(path << ": " << line);
      std::int64_t arrival_ns = 0;
      std::string form;
      REQUIRE(key == "at");
      REQUIRE(words >> arrival_ns >> form);
      REQUIRE((form == "hex" || form == "line" || form == "bodies"));
      if (form != "line") {
        log.rows.push_back({arrival_ns, hex_bytes(words), form == "bodies"});
        continue;
      }
      const std::string text = rest_of(words) + '\n';
      const auto bytes = std::as_bytes(std::span(text));
      log.rows.push_back({arrival_ns, std::vector(bytes.begin(), bytes.end())});
    }
  }
  return log;
}

std::string decoded_lines(const RecordedLog& log) {
  const drivers::Driver* driver = drivers::find_driver(log.driver);
  REQUIRE(driver != nullptr);
  const auto description = driver->describe(log.text, log.identity);
  if (!description) FAIL(description.error().text());
  const auto decoder = driver->make_decoder(*description);
  REQUIRE(decoder);
  CollectSink sink;
  std::string lines;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts;
  for (const RecordedLog::Row& row : log.rows) {
    if (row.bodies) {
      lines += use_bodies(*driver, row.bytes, **decoder, layouts);
      continue;
    }
    sink.descriptions = 0;
    (*decoder)->feed(row.bytes, row.arrival_ns, sink);
    if (sink.descriptions > 0) {
      lines += "description of " + std::to_string(sink.described.size()) + " bytes\n";
    }
    for (std::size_t i = 0; i < sink.frames.size(); ++i) {
      if (driver->make_layout != nullptr) lines += "body " + std::to_string(sink.bodies[i]) + ' ';
      lines += line_of(sink.frames[i]);
    }
    for (const Sample& sample : sink.samples) lines += line_of(sample);
    sink.frames.clear();
    sink.bodies.clear();
    sink.samples.clear();
  }
  lines += "outcomes";
  for (std::size_t i = 0; i < sink.outcomes.size(); ++i) {
    lines += ' ' + std::string(kOutcomeNames[i]) + ' ' + std::to_string(sink.outcomes[i]);
  }
  return lines + '\n';
}

std::string first_difference(const std::string& got, const std::string& expected) {
  std::istringstream lines_a(got);
  std::istringstream lines_b(expected);
  std::string a;
  std::string b;
  for (int number = 1;; ++number) {
    const bool more_a = static_cast<bool>(std::getline(lines_a, a));
    const bool more_b = static_cast<bool>(std::getline(lines_b, b));
    if (!more_a && !more_b) return {};
    if (more_a != more_b || !same_line(a, b)) {
      return "line " + std::to_string(number) + ": got '" + (more_a ? a : "the end") +
             "', expected '" + (more_b ? b : "the end") + "'";
    }
  }
}

std::string expected_lines(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

void update_expected(const std::filesystem::path& path, const std::string& got) {
  if (first_difference(got, expected_lines(path)).empty()) return;
  std::ofstream(path) << got;
}

}  // namespace posed::test
