#include "judge/converge/report_style.h"

namespace crt::converge {

std::string pageCss() {
    return R"(:root{color-scheme:light dark;--good:#00704f;--warn:#8a5a00;--bad:#b3261e;--panel:#f6f7f9;
--accent:#0072b2}
@media (prefers-color-scheme:dark){:root{--good:#4fd1a5;--warn:#f0c24b;--bad:#ff8a80;--panel:#1d2024;
--accent:#6cbcf0}}
@media print{:root{color-scheme:light;--good:#00563d;--warn:#6b4500;--bad:#8c1d17;--panel:#fff;
--accent:#000}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif;
font-variant-numeric:tabular-nums}
main,header,footer{max-width:1180px;margin:0 auto;padding:0 16px}
header{padding-top:28px}
h1{font-size:1.75rem;line-height:1.2;margin:0 0 4px;letter-spacing:-.01em}
h2{font-size:1.35rem;line-height:1.25;margin:52px 0 6px;padding-top:14px;border-top:2px solid var(--ink)}
h3{font-size:1.05rem;margin:34px 0 8px}
p{margin:6px 0;max-width:75ch}
a{color:var(--accent)}
.sub{color:var(--muted)}
nav{margin:12px 0 0;display:flex;flex-wrap:wrap;gap:4px 18px}
.findings{list-style:none;margin:12px 0;padding:0;max-width:85ch}
.findings li{padding:5px 0 5px 26px;position:relative}
.findings li::before{position:absolute;left:2px;top:5px;font-weight:700}
.good::before{content:"✓";color:var(--good)}.neutral::before{content:"•";color:var(--muted)}
.warning::before{content:"!";color:var(--warn);left:6px!important}
.bad::before{content:"✗";color:var(--bad)}
.findings .verdict{font-size:.85em;margin-left:.5em}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,460px),1fr));gap:36px 40px;
margin:26px 0;align-items:start}
figure{margin:0;break-inside:avoid;min-width:0}
figure h3{margin:0 0 6px}
figure .plot{max-width:520px}
figcaption{color:var(--muted);font-size:.875rem;line-height:1.45;margin-top:6px;max-width:65ch}
.tablebox{overflow-x:auto;margin:14px 0}
table{border-collapse:collapse;width:100%;font-size:.9rem;line-height:1.35}
th,td{text-align:left;vertical-align:top;padding:7px 14px 7px 0;border-bottom:1px solid var(--grid)}
thead th{border-bottom:1.5px solid var(--ink);font-weight:600;vertical-align:bottom}
tbody th{font-weight:600}
.num{text-align:right;white-space:nowrap}
.num:last-child{padding-right:0}
td.wide{min-width:14em}
.ci{display:block;color:var(--muted);font-size:.8rem}
.verdict{font-weight:700;white-space:nowrap}
.PASS{color:var(--good)}.FAIL{color:var(--bad)}.INCONCLUSIVE{color:var(--warn)}.OMITTED{color:var(--muted)}
.key{display:inline-block;width:.8em;height:.8em;margin-right:.45em;border-radius:2px;background:var(--c)}
.maps{display:grid;grid-template-columns:repeat(5,1fr);gap:8px;margin:6px 0 20px;max-width:1180px}
.maps figure{text-align:center}
.maps img{display:block;width:100%;height:auto;image-rendering:pixelated;border:1px solid var(--grid)}
.maps figcaption{margin-top:3px;font-size:.8rem;max-width:none}
.scales{display:flex;flex-wrap:wrap;gap:12px 32px;margin:10px 0 22px}
.scale{flex:1 1 250px;max-width:360px;font-size:.8rem;color:var(--muted)}
.ramp{height:12px;border:1px solid var(--grid);margin:3px 0;-webkit-print-color-adjust:exact;
print-color-adjust:exact}
.ends{display:flex;justify-content:space-between}
pre{background:var(--panel);border:1px solid var(--grid);border-radius:6px;padding:10px 12px;
white-space:pre-wrap;overflow-wrap:anywhere;font:.85rem/1.45 ui-monospace,
SFMono-Regular,Menlo,"DejaVu Sans Mono",monospace;margin:8px 0}
dl{display:grid;grid-template-columns:max-content 1fr;gap:4px 22px;margin:10px 0;font-size:.92rem}
dt{color:var(--muted)}dd{margin:0;overflow-wrap:anywhere;min-width:0}
code{font:.9em ui-monospace,SFMono-Regular,Menlo,"DejaVu Sans Mono",monospace;overflow-wrap:anywhere}
footer{margin-top:56px;padding-bottom:40px;color:var(--muted);font-size:.875rem}
@media (max-width:700px){
h1{font-size:1.45rem}h2{font-size:1.2rem;margin-top:40px}
.maps{grid-template-columns:repeat(2,1fr)}
dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:8px}
.cards thead{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
.cards,.cards tbody,.cards tr,.cards td,.cards th{display:block;width:100%}
.cards tr{border:1px solid var(--grid);border-radius:8px;padding:8px 12px;margin:0 0 12px;
background:var(--panel)}
.cards th,.cards td{border:0;padding:3px 0;text-align:left}
.cards td{display:flex;justify-content:space-between;gap:16px}
.cards td::before{content:attr(data-label);color:var(--muted);flex:0 0 auto;max-width:45%}
.cards td>span{text-align:right}
.cards td.wide{display:block;min-width:0}.cards td.wide>span{text-align:left}
.cards td.wide::before{display:block;max-width:none}
.num{white-space:normal}
}
@page{size:landscape;margin:14mm}
@media print{html{font-size:12.5px}body{font-size:1rem}main,header,footer{max-width:none;padding:0}
section+section h2{break-before:page}h3{break-after:avoid}
tr,.maps{break-inside:avoid}.tablebox{overflow:visible}td.wide{min-width:12em}p.sub{break-after:avoid}
.figures{grid-template-columns:1fr 1fr 1fr;gap:18px 24px}nav{display:none}}
)";
}

}  // namespace crt::converge
