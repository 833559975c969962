"""The CSS of the reports: light or dark as the reader's system."""

STYLE = """
:root{color-scheme:light dark;--bg:#f6f7f9;--card:#fff;--ink:#1b2430;--soft:#5b6675;--line:#dfe4ea;
  --grid:#e9edf2;--field:#fbfcfd;--accent:#0b6bcb;--bad:#c0362c;--good:#1c7c4a;--hint:#a56200;
  --grey:#a3abb6;--c0:#0b6bcb;--c1:#d9730d;--c2:#12857a;--c3:#8a3ffc;--c4:#b8336a}
@media (prefers-color-scheme:dark){:root{--bg:#11161d;--card:#19202a;--ink:#e6ebf2;--soft:#9aa6b5;
  --line:#2c3644;--grid:#252e3a;--field:#151b24;--accent:#5eb0ff;--bad:#ff8177;--good:#5fd39a;
  --hint:#f0b45b;--grey:#667182;--c0:#5eb0ff;--c1:#ffa657;--c2:#4fd1c0;--c3:#b794ff;--c4:#ff8fb8}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:88rem;margin:0 auto;padding:1.5rem clamp(.75rem,3vw,2.5rem) 4rem}
h1{font-size:clamp(1.5rem,4vw,2.2rem);line-height:1.2;margin:.2em 0;letter-spacing:-.01em}
h2{font-size:1.25rem;margin:2.4rem 0 .7rem}
h3{font-size:1.05rem;margin:0}
a{color:var(--accent);text-decoration:none}
a:hover{text-decoration:underline}
code{font-size:.92em;overflow-wrap:anywhere}
p{margin:.4rem 0}
.lead{color:var(--soft);max-width:62rem}
.cards{display:grid;align-items:start;gap:1rem;grid-template-columns:repeat(auto-fill,minmax(min(100%,25rem),1fr))}
.card{background:var(--card);border:1px solid var(--line);border-radius:12px;padding:1rem 1.1rem;
  font-size:.92rem;min-width:0;display:flex;flex-direction:column}
.card svg{width:100%;height:auto;display:block;margin-top:auto;padding-top:.5rem}
.stage{color:var(--accent);font-size:.74rem;letter-spacing:.06em;text-transform:uppercase;margin:0}
.metric{color:var(--soft);font:.8rem ui-monospace,SFMono-Regular,Menlo,monospace;margin:0 0 .3rem}
.advice{font-weight:600}
.note,.keys,.legend{color:var(--soft);font-size:.84rem}
.key{margin-right:.9rem;white-space:nowrap}
.key i{display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.35em}
.k0{background:var(--c0)}
.k1{background:var(--c1)}
.k2{background:var(--c2)}
.k3{background:var(--c3)}
.k4{background:var(--c4)}
.legend svg{height:1em;width:auto;vertical-align:-.15em}
.wide{overflow-x:auto}
table{border-collapse:collapse;font-size:.86rem;width:100%}
th,td{text-align:left;padding:.34rem .7rem .34rem 0;border-bottom:1px solid var(--line);
  white-space:nowrap}
thead th{color:var(--soft);font-weight:500}
tbody th{font-weight:500}
.n{font-variant-numeric:tabular-nums}
.used th,.used td{font-weight:700}
.glance td:last-child{white-space:normal}
.tag{border-radius:99px;padding:.1rem .6rem;font-size:.8rem;border:1px solid currentColor;
  white-space:nowrap}
.tag.good{color:var(--good)}
.tag.bad{color:var(--bad);font-weight:700}
.tag.hint{color:var(--hint)}
.tag.plain{color:var(--soft)}
.bars .bar{width:55%;min-width:8rem}
.bar span{display:block;height:1rem;min-width:2px;border-radius:4px;background:var(--c0)}
.warnings{padding-left:1.2rem;font-size:.92rem}
.warnings li{margin:.25rem 0;overflow-wrap:anywhere}
details{margin-top:.6rem}
summary{cursor:pointer;color:var(--accent);font-size:.86rem}
.field{fill:var(--field)}
.grid{stroke:var(--grid);fill:none}
.break{stroke:var(--line);stroke-dasharray:2 3;fill:none}
.tick{fill:var(--soft);font-size:11px}
.axis{fill:var(--soft);font-size:11.5px}
.name{fill:var(--ink);font-size:11.5px;paint-order:stroke;stroke:var(--field);stroke-width:3px;
  stroke-linejoin:round}
.name.used{font-weight:700}
.name.grey{fill:var(--grey)}
.limit{fill:var(--bad);font-size:11px}
.budget{stroke:var(--bad);stroke-width:1.3;stroke-dasharray:6 4;fill:none}
.beyond{fill:var(--bad);opacity:.06}
.front{fill:none;stroke-width:1.6;opacity:.55}
.spread{fill:none;stroke-width:1.2}
.dot{stroke:var(--card);stroke-width:1.2;fill-opacity:.85}
.ring{fill:none;stroke:var(--ink);stroke-width:1.7}
.dot.c0{fill:var(--c0)}
.dot.c1{fill:var(--c1)}
.dot.c2{fill:var(--c2)}
.dot.c3{fill:var(--c3)}
.dot.c4{fill:var(--c4)}
.dot.dominated{fill:var(--grey)}
.front.c0,.spread.c0{stroke:var(--c0)}
.front.c1,.spread.c1{stroke:var(--c1)}
.front.c2,.spread.c2{stroke:var(--c2)}
.front.c3,.spread.c3{stroke:var(--c3)}
.front.c4,.spread.c4{stroke:var(--c4)}
.spread.dominated{stroke:var(--grey)}
"""
