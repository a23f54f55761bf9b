#include "daemon/tools/logs/list_takes.hpp"

#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/export/log_takes.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

// "2  walk  from 3.20 s, 10.05 s long", a line each. Of a take with gaps only what is left has a
// time, so that it may seem shorter than it was.
void print_takes(const std::vector<replay::LoggedTake>& takes) {
  for (const replay::LoggedTake& take : takes) {
    std::string end = take.row.last_item == log::kToTheEnd ? ", to the end of the recording" : "";
    if (take.has_gaps) end += "; the log lacks a part of it (`posed replay` says which)";
    std::printf("%lld  %s  ", static_cast<long long>(take.row.id), clean(take.row.name).c_str());
    if (take.begin_s) {
      std::printf("from %.2f s, %.2f s long%s\n", *take.begin_s, *take.end_s - *take.begin_s,
                  end.c_str());
    } else {
      std::printf("nothing came%s\n", end.c_str());
    }
  }
}

void print_takes_json(const std::vector<replay::LoggedTake>& takes) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const replay::LoggedTake& take : takes) {
    nlohmann::ordered_json& one =
        list.emplace_back(nlohmann::ordered_json{{"take", take.row.id},
                                                 {"name", take.row.name},
                                                 {"first_item", take.row.first_item},
                                                 {"ended", take.row.last_item != log::kToTheEnd},
                                                 {"gaps", take.has_gaps}});
    if (one["ended"]) one["last_item"] = take.row.last_item;
    if (!take.begin_s) continue;
    one["begin_s"] = *take.begin_s;
    one["length_s"] = *take.end_s - *take.begin_s;
  }
  std::printf("%s\n", json_text(list).c_str());
}

}  // namespace

int list_takes(const std::string& path, bool json) {
  auto reader = log::Reader::open(path);
  if (!reader) return report(reader.error());
  const auto takes = replay::logged_takes(*reader);
  if (!takes) return report(takes.error());
  if (json) {
    print_takes_json(*takes);
  } else if (takes->empty()) {
    std::fprintf(stderr, "posed: %s: has no takes\n", path.c_str());
  } else {
    print_takes(*takes);
  }
  return static_cast<int>(ExitCode::kDone);
}

}  // namespace posed::tools
