#include "daemon/tools/logs/junit.hpp"

#include <algorithm>
#include <ostream>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <pugixml.hpp>

#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {

Result<> write_junit(const std::filesystem::path& path, std::span<const JUnitCase> cases) {
  double took_s = 0.0;
  for (const JUnitCase& one : cases) took_s += one.took_s;
  pugi::xml_document document;
  auto suite = document.append_child("testsuites").append_child("testsuite");
  const auto set = [](pugi::xml_node node, const char* name, std::string_view value) {
    node.append_attribute(name).set_value(clean(value).c_str());
  };
  set(suite, "name", "posed replay");
  set(suite, "tests", fmt::format("{}", cases.size()));
  set(suite, "failures", fmt::format("{}", std::ranges::count_if(cases, [](const JUnitCase& one) {
                                       return !one.problem.empty();
                                     })));
  set(suite, "time", fmt::format("{:.3f}", took_s));
  for (const JUnitCase& one : cases) {
    auto test = suite.append_child("testcase");
    set(test, "classname", "posed.replay");
    set(test, "name", one.name);
    set(test, "time", fmt::format("{:.3f}", one.took_s));
    if (!one.problem.empty()) set(test.append_child("failure"), "message", one.problem);
  }
  return write_whole_file(path, [&](std::ostream& out) { document.save(out, "  "); });
}

}  // namespace posed::tools
