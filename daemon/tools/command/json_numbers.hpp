// The figures that `--json` prints, in a report: as a table of numbers, and as they are. Cold.
#pragma once

#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/report/bench_sections.hpp"
#include "daemon/tools/report/page.hpp"

namespace posed::tools {

// Every number of the object and of the objects in it, "kernel.length_deg", except those under the
// names `without`. Lists are left out.
[[nodiscard]] std::vector<report::NamedNumber> numbers_of(
    const nlohmann::ordered_json& figures, const std::vector<std::string_view>& without = {});

// The whole text, folded away.
void add_json(const nlohmann::ordered_json& figures, report::Page& page);

}  // namespace posed::tools
