// A strict reader of Prometheus' text format, for what a daemon serves. What it does not expect is
// a failed check.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include <catch2/catch.hpp>

#include "tests/support/raw_peer.hpp"

namespace posed::test {

// "127.0.0.1:5572" of "http://127.0.0.1:5572/metrics".
inline std::string host_of_url(const std::string& url) {
  return url.substr(7, url.find('/', 7) - 7);
}

// The whole answer to an HTTP request with this first line.
inline std::string http_answer(const std::string& url, const std::string& first_line,
                               const std::string& headers = "") {
  const RawPeer peer(host_of_url(url));
  if (!peer.send(first_line + " HTTP/1.1\r\nHost: " + host_of_url(url) + "\r\n" + headers +
                 "Connection: close\r\n\r\n")) {
    return {};
  }
  return peer.receive(10'000'000);
}

inline int http_status(const std::string& answer) {
  return answer.size() < 12 ? 0 : std::atoi(answer.substr(9, 3).c_str());
}

class MetricsPage {
 public:
  using Labels = std::map<std::string, std::string>;
  struct Family {
    std::string type;
    std::map<std::string, std::map<Labels, double>> samples;  // by name
  };

  // Asks for it.
  explicit MetricsPage(const std::string& url) {
    const std::string answer = http_answer(url, "GET /metrics");
    INFO(answer.substr(0, 500));
    REQUIRE(http_status(answer) == 200);
    const auto body = answer.find("\r\n\r\n");
    REQUIRE(body != std::string::npos);
    CHECK(answer.substr(0, body).find("text/plain; version=0.0.4") != std::string::npos);
    text = answer.substr(body + 4);
    CHECK(text.ends_with('\n'));
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) read(line);
    for (const auto& [name, family] : families) check(name, family);
  }

  // The sum of the samples that have these labels; nothing if there is none.
  [[nodiscard]] std::optional<double> value(const std::string& name,
                                            const Labels& labels = {}) const {
    std::optional<double> sum;
    for (const auto& [family_name, family] : families) {
      const auto found = family.samples.find(name);
      if (found == family.samples.end()) continue;
      for (const auto& [own, value] : found->second) {
        const bool fits = std::ranges::all_of(labels, [&own = own](const auto& label) {
          const auto at = own.find(label.first);
          return at != own.end() && at->second == label.second;
        });
        if (fits) sum = sum.value_or(0.0) + value;
      }
    }
    return sum;
  }

  std::string text;
  std::map<std::string, Family> families;

 private:
  static bool is_name(const std::string& name) {
    return !name.empty() && (name[0] < '0' || name[0] > '9') &&
           name.find_first_not_of(
               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") ==
               std::string::npos;
  }

  void read(const std::string& line) {
    INFO(line);
    std::istringstream words(line);
    std::string sign, kind, name;
    if (line.starts_with("# ")) {
      words >> sign >> kind >> name;
      REQUIRE(is_name(name));
      if (kind == "HELP") {
        CHECK(families.emplace(name, Family{}).second);  // each family once, with help first
        last_ = name;
        return;
      }
      REQUIRE(kind == "TYPE");
      REQUIRE(name == last_);
      REQUIRE(families[name].type.empty());
      words >> families[name].type;
      return;
    }
    read_sample(line);
  }

  void read_sample(const std::string& line) {
    const auto end = line.find_first_of("{ ");
    REQUIRE(end != std::string::npos);
    const std::string name = line.substr(0, end);
    REQUIRE(is_name(name));
    Family& family = families.at(last_);
    const bool own =
        name == last_ ||
        (family.type == "histogram" &&
         (name == last_ + "_bucket" || name == last_ + "_sum" || name == last_ + "_count"));
    REQUIRE(own);
    std::size_t at = end;
    const Labels labels = line[at] == '{' ? read_labels(line, at) : Labels{};
    REQUIRE(line.at(at) == ' ');
    const std::string number = line.substr(at + 1);
    char* rest = nullptr;
    const double value = std::strtod(number.c_str(), &rest);
    REQUIRE(*rest == '\0');
    CHECK(family.samples[name].emplace(labels, value).second);  // no series twice
  }

  // `at`: the opening bracket; afterwards behind the closing one.
  static Labels read_labels(const std::string& line, std::size_t& at) {
    Labels labels;
    do {
      const auto equals = line.find("=\"", ++at);
      REQUIRE(equals != std::string::npos);
      const std::string label = line.substr(at, equals - at);
      CHECK(is_name(label));
      std::string value;
      for (at = equals + 2; line.at(at) != '"'; ++at) {
        if (line[at] != '\\') {
          value += line[at];
          continue;
        }
        ++at;
        REQUIRE(std::string("\\\"n").find(line.at(at)) != std::string::npos);
        value += line[at] == 'n' ? '\n' : line[at];
      }
      CHECK(labels.emplace(label, value).second);
      ++at;
    } while (line.at(at) == ',');
    REQUIRE(line.at(at) == '}');
    ++at;
    return labels;
  }

  static void check(const std::string& name, const Family& family) {
    INFO(name);
    CHECK(std::set<std::string>{"counter", "gauge", "histogram"}.contains(family.type));
    CHECK((family.type == "counter") == name.ends_with("_total"));
    if (family.type == "histogram") check_histogram(name, family);
  }

  // Each series has growing buckets, the last of which counts all of them.
  static void check_histogram(const std::string& name, const Family& family) {
    if (family.samples.empty()) return;
    std::map<Labels, std::map<double, double>> buckets;  // by the bound
    for (const auto& [all_labels, value] : family.samples.at(name + "_bucket")) {
      Labels labels = all_labels;
      const double bound = std::strtod(labels.at("le").c_str(), nullptr);
      labels.erase("le");
      buckets[labels][bound] = value;
    }
    for (const auto& [labels, values] : buckets) {
      CHECK(values.size() > 10);
      double before = 0.0;
      for (const auto& [bound, value] : values) {
        CHECK(value >= before);
        before = value;
      }
      CHECK(std::isinf(values.rbegin()->first));
      CHECK(family.samples.at(name + "_count").at(labels) == before);
      CHECK(family.samples.at(name + "_sum").at(labels) >= 0.0);
    }
    CHECK(buckets.size() == family.samples.at(name + "_sum").size());
  }

  std::string last_;  // family
};

}  // namespace posed::test
