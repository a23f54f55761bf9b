// The style sheet of every report. The poses are drawn by daemon/picture for white paper; the rules
// of `.strip` turn its greys and its white outlines to the page's own. Cold.
#pragma once

namespace posed::report {

inline constexpr const char* kStyleSheet = R"(
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--soft:#57606a;--line:#d0d7de;
--card:#f6f8fa;--good:#00664d;--bad:#b03a00;--s0:#0072b2;--s1:#d55e00;--s2:#009e73;--s3:#cc79a7;
--s4:#b58900;--s5:#3b9bd1;--s6:#4d4d4d}
@media (prefers-color-scheme:dark){:root{--paper:#15181c;--ink:#e6e9ed;--soft:#9aa5b1;
--line:#3a424c;--card:#1d2127;
--good:#4cc9a0;--bad:#ff9b66;--s0:#56a9e0;--s1:#ff8a3d;--s2:#33c79b;--s3:#e6a3c6;
--s4:#f0c44c;--s5:#9ad0f5;--s6:#b8bec6}}
@media print{:root{--paper:#fff;--ink:#000;--soft:#444;--line:#bbb;--card:#fff}
figure,tr{break-inside:avoid}h2{break-after:avoid}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:66rem;padding:1.5rem 1.25rem 4rem;background:var(--paper);
color:var(--ink);font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.7rem;line-height:1.25;margin:0 0 .25rem}
h2{font-size:1.3rem;margin:2.5rem 0 .75rem;padding-top:.75rem;border-top:1px solid var(--line)}
h3{font-size:1.05rem;margin:0}
.by,.see{color:var(--soft)}.see{margin:.25rem 0 .75rem;max-width:50rem}
.verdict{margin:1rem 0;padding:.75rem 1rem;border-left:5px solid var(--good);background:var(--card);
font-size:1.1rem}
.verdict.bad{border-color:var(--bad)}.verdict b{color:var(--good)}.verdict.bad b{color:var(--bad)}
ul.warnings{margin:.5rem 0;padding-left:1.25rem}
figure{margin:1.25rem 0 2rem}
figure>svg,details>svg{display:block;margin:.5rem 0}
.wide{overflow-x:auto}
svg{max-width:max(100%,36rem);height:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.92rem;margin:.5rem 0}
th,td{padding:.25rem .75rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
th{color:var(--soft);font-weight:600}
th.n,td.n{text-align:right}
summary{cursor:pointer;padding:.25rem 0}summary h3{display:inline}
pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:.8rem;background:var(--card);padding:1rem}
.chart text,.tree text{font:12px system-ui,sans-serif;fill:var(--ink)}
.chart .end{text-anchor:end}.chart .mid{text-anchor:middle}.chart .quiet{fill:var(--soft)}
.chart .head{font-weight:600}
.chart .grid{stroke:var(--line);stroke-width:1}.chart .frame{stroke:var(--soft);fill:none}
.chart .rule{stroke:var(--soft);stroke-width:1.2;stroke-dasharray:5 4}
.chart .cell{stroke:var(--paper);stroke-width:2}
.chart .tie{stroke:var(--soft);stroke-width:1;opacity:.55}
.chart polyline{fill:none;stroke-width:2;stroke-linejoin:round}
.s0{--c:var(--s0)}.s1{--c:var(--s1)}.s2{--c:var(--s2)}.s3{--c:var(--s3)}.s4{--c:var(--s4)}
.s5{--c:var(--s5)}.s6{--c:var(--s6)}
.stroke{stroke:var(--c)}.fill{fill:var(--c)}.band{fill:var(--c);opacity:.22}
.tree .ask{fill:var(--paper);stroke:var(--soft)}.tree .leaf{fill:var(--card);stroke:var(--s2)}
.tree .way{stroke:var(--soft);fill:none}.tree .quiet{fill:var(--soft)}
.strip text{font:13px system-ui,sans-serif;text-anchor:middle;fill:var(--ink)}
.strip .title{font-weight:600;text-anchor:start}
.strip .row,.strip .see{text-anchor:start}.strip .row{font-weight:600}
.strip line{stroke-linecap:round}.strip .ground{stroke:var(--soft);stroke-linecap:butt}
.strip [stroke="#fff"]{stroke:var(--paper)}
.strip [stroke="#4d4d4d"]{stroke:var(--s6)}.strip [fill="#4d4d4d"]{fill:var(--s6)}
.strip [stroke="#0072b2"]{stroke:var(--s0)}.strip [stroke="#d55e00"]{stroke:var(--s1)}
)";

}  // namespace posed::report
