#include "master_station/report/report_page.h"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>

#include "codecs/text/whole_file.h"
#include "master_station/report/embedded_page.h"
#include "master_station/report/report_glossary.h"

namespace farfeel::master_station {
namespace {

std::string base64(std::span<const unsigned char> bytes) {
  std::string text(sodium_base64_ENCODED_LEN(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();  // its own end
  return text;
}

// Little-endian floats, as the page's Float32Array reads them on every machine with a browser.
std::string base64(const std::vector<float>& values) {
  return base64({reinterpret_cast<const unsigned char*>(values.data()), values.size() * sizeof(float)});
}

std::string base64(const std::string& bytes) {
  return base64({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// Line names come from this folder's own table and hold letters, digits and underscores only: no escaping is needed.
std::string trace_json(const SessionTrace& trace) {
  std::string json = fmt::format(R"({{"rows":{},"rows_per_bucket":{},"time_s":"{}","state":"{}","lines":[)", trace.rows,
                                 trace.rows_per_bucket, base64(trace.time_s), base64(trace.state));
  for (const TraceLine& line : trace.lines) {
    if (&line != &trace.lines.front()) json += ',';
    const bool is_one_value = trace.rows_per_bucket == 1;
    json += fmt::format(R"({{"name":"{}","low":"{}","high":{}}})", line.name, base64(line.low),
                        is_one_value ? "null" : '"' + base64(line.high) + '"');
  }
  return json + "]}";
}

std::string tile(std::string_view figure, std::string_view unit, std::string_view what, bool is_bad = false) {
  return fmt::format(
      R"(<div class="card tile{}"><div class="figure">{} <small>{}</small></div><div class="what">{}</div></div>)"
      "\n",
      is_bad ? " bad" : "", figure, unit, what);
}

std::string tiles(const SessionSummary& s) {
  std::string out;
  out += tile(shown_figure(100 * s.contact_share, 0), "%", "of the time in contact");
  out += tile(shown_figure(s.contacts.mean_in_contact, 1), "contacts",
              fmt::format("on average while touching, at most {}", shown_figure(s.contacts.max, 0)));
  out += tile(shown_figure(s.force_N.max), "N", fmt::format("greatest force, {} N rms", shown_figure(s.force_N.rms)));
  out += tile(shown_figure(s.tick_hz, 0), "Hz", fmt::format("haptic loop, {} ticks missed", s.ticks_missed));
  out += tile(shown_figure(s.wake_us.p99), "µs",
              fmt::format("late at 99 % of ticks, at most {} µs", shown_figure(s.wake_us.max)));
  out += tile(shown_figure(s.slave_contact_hz, 0), "Hz",
              fmt::format("contact service, {} µs median", shown_figure(s.slave_contact_us.p50)));
  out += tile(shown_figure(s.rtt_ms.p50), "ms",
              fmt::format("round trip median, {} ms at 99 %", shown_figure(s.rtt_ms.p99)));
  out += tile(fmt::format("{}", s.faults), "", s.faults == 1 ? "fault" : "faults", s.faults > 0);
  return out;
}

using Row = std::pair<std::string_view, std::string>;

std::string table(std::span<const Row> rows) {
  std::string out = "<table>";
  for (const auto& [what, figures] : rows) out += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", what, figures);
  return out + "</table>";
}

std::string glossary() {
  std::string out = "<details class=\"card\"><summary>What these lines mean</summary><table>";
  for (const auto& [line, meaning] : kReportGlossary)
    out += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", line, escaped(meaning));
  return out + "</table></details>";
}

std::string facts(const SessionSummary& s) {
  const auto loop = [](const LoopTimes& t) {
    return fmt::format("{} · {} · {} · {} µs", shown_figure(t.p50), shown_figure(t.p99), shown_figure(t.p99_9),
                       shown_figure(t.max));
  };
  const auto mJ = [](double energy_J) { return shown_figure(1e3 * energy_J, 3); };
  const std::array<Row, 19> figures = {{
      {"Scene, seed", fmt::format("{}, {}", escaped(s.scene), s.seed)},
      {"Length", fmt::format("{} s, {} ticks, {} missed", shown_figure(s.seconds, 3), s.ticks, s.ticks_missed)},
      {"Loop", fmt::format("{} Hz asked for, {} Hz measured; {} thread, memory {}locked, {} page faults after warm-up",
                           shown_figure(s.loop.asked_hz, 0), shown_figure(s.tick_hz, 2),
                           s.loop.is_fifo ? "SCHED_FIFO" : "ordinary", s.loop.is_memory_locked ? "" : "not ",
                           s.loop.page_faults)},
      {"Rendering", fmt::format("controller {}, rung {}, integrator {}", escaped(s.loop.controller),
                                escaped(s.loop.rung), escaped(s.loop.integrator))},
      {"Tick's work", "p50 · p99 · p99.9 · max<br>" + loop(s.tick_us)},
      {"Tick's wake-up", "p50 · p99 · p99.9 · max<br>" + loop(s.wake_us)},
      {"Contact service", fmt::format("{} Hz<br>p50 · p99 · max<br>{} · {} · {} µs",
                                      shown_figure(s.slave_contact_hz, 1), shown_figure(s.slave_contact_us.p50),
                                      shown_figure(s.slave_contact_us.p99), shown_figure(s.slave_contact_us.max))},
      {"Contacts", fmt::format("{} on average in contact, at most {}; in contact {} of the ticks",
                               shown_figure(s.contacts.mean_in_contact, 2), shown_figure(s.contacts.max, 0),
                               shown_figure(100 * s.contact_share, 1) + " %")},
      {"Pairs near",
       fmt::format("{} on average, at most {}", shown_figure(s.pairs.mean, 1), shown_figure(s.pairs.max, 0))},
      {"Loop was", told(s.states)},
      {"Force on the hand",
       fmt::format("{} N rms, {} N max", shown_figure(s.force_N.rms), shown_figure(s.force_N.max))},
      {"Torque on the hand", fmt::format("{} mN·m rms, {} mN·m max", shown_figure(1e3 * s.torque_Nm.rms),
                                         shown_figure(1e3 * s.torque_Nm.max))},
      {"Round trip",
       fmt::format("{} ms median, {} ms at 99 %", shown_figure(s.rtt_ms.p50), shown_figure(s.rtt_ms.p99))},
      {"Felt from tiles", s.local_model.tile_bytes > 0 ? felt_from_tiles(s.local_model) : "none"},
      {"Least energy", fmt::format("tank {} mJ, contact port {} mJ, device port {} mJ", mJ(s.energy.tank_least_J),
                                   mJ(s.energy.contact_port_least_J), mJ(s.energy.device_port_least_J))},
      {"Updates", fmt::format("{} that the tank could not pay at once", s.energy.truncations)},
      {"Poses up", told(s.up)},
      {"Contacts down", told(s.down)},
      {"Scene received",
       fmt::format("{:.1f} kB in {} ms", static_cast<double>(s.scene_bytes) / 1e3, shown_figure(s.scene_ms))},
  }};
  const Machine& m = s.machine;
  const std::array<Row, 7> machine = {{
      {"Started", escaped(m.started_utc)},
      {"By", escaped(fmt::format("{} on {}", m.user, m.host))},
      {"Processor", escaped(fmt::format("{}, {} cores seen", m.cpu, m.cores))},
      {"Memory", fmt::format("{} GiB", shown_figure(m.memory_GiB))},
      {"System", escaped(fmt::format("{}, {}", m.os, m.kernel))},
      {"Compiler", escaped(m.compiler)},
      {"Command", "<code>" + escaped(m.command) + "</code>"},
  }};
  return fmt::format(R"(<div class="facts"><div class="card">{}</div><div class="card">{}</div></div>)", table(figures),
                     table(machine));
}

std::string picture(const std::string& png, std::string_view caption) {
  return fmt::format(
      R"(<figure class="card"><img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{0}</figcaption>)"
      "</figure>\n",
      caption, base64(png));
}

std::string pictures(const ReportPictures& p) {
  if (p.scene_png.empty() && p.contacts_png.empty())
    return fmt::format(R"(<div class="card no-picture">No picture of the scene: {}</div>)",
                       escaped(p.why_none.empty() ? "none was made in this session" : p.why_none));
  std::string out = R"(<div class="pictures">)";
  if (!p.scene_png.empty()) out += picture(p.scene_png, "The scene with the tool, and the contact forces on it");
  if (!p.contacts_png.empty())
    out += picture(p.contacts_png, "Nearer to the contact that presses hardest; what hides it is seen through");
  return out + "</div>";
}

std::string how_drawn(const SessionTrace& trace, std::uint64_t ticks) {
  std::string words = trace.rows_per_bucket == 1
                          ? fmt::format("All {} recorded ticks are in this page.", trace.rows)
                          : fmt::format(
                                "{} recorded ticks are in this page as the least and the greatest value of every {} of "
                                "them, so every peak is there; <code>{}</code> holds each.",
                                trace.rows, trace.rows_per_bucket, kCsvFile);
  if (trace.rows < ticks)
    words += fmt::format(
        " The session had {}: later ones were recorded ever more rarely, but for those around a fault "
        "(<code>--csv-every 1</code> records all).",
        ticks);
  return words;
}

std::optional<std::string> file_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(file), {});
}

tl::expected<void, ReportError> write_file(const std::string& path, const std::string& bytes) {
  if (std::string why = codecs::write_whole_file(path, bytes); !why.empty())
    return tl::unexpected(ReportError{std::move(why)});
  return {};
}

}  // namespace

std::string report_html(const SessionSummary& s, const SessionTrace& trace, const ReportPictures& p) {
  std::string html = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html += fmt::format("<title>{}, seed {} · Farfeel</title>\n", escaped(s.scene), s.seed);
  html += fmt::format("<style>{}</style>\n</head>\n<body>\n<main>\n", report_style());
  html += fmt::format("<h1>{}, felt for {} s</h1>\n", escaped(s.scene), shown_figure(s.seconds, 1));
  html += fmt::format("<div class=\"quiet\">seed {} · {} · {} on {}</div>\n", s.seed, escaped(s.machine.started_utc),
                      escaped(s.machine.user), escaped(s.machine.host));
  html += "<div class=\"tiles\">\n" + tiles(s) + "</div>\n";
  html += "<h2>What was touched</h2>\n" + pictures(p);
  html +=
      "<h2>What was felt</h2>\n<div class=\"card ribbon\"><h3>State of the loop</h3><canvas id=\"states\"></canvas>"
      "<div class=\"legend\" id=\"state-legend\"></div><h3>Felt from</h3><canvas id=\"rungs\"></canvas>"
      "<div class=\"legend\" id=\"rung-legend\"></div></div>\n<div class=\"plots\" id=\"plots\"></div>\n";
  if (report_script().empty())
    html +=
        "<p>There are no plots: the program that wrote this was built without uPlot, which deploy/install-packages "
        "fetches.</p>\n";
  html += "<noscript>The plots need JavaScript; the figures below do not.</noscript>\n";
  html += fmt::format("<p class=\"quiet\">{} Forces and torques act on the hand, in the world's axes.</p>\n",
                      how_drawn(trace, s.ticks));
  html += "<h2>In figures</h2>\n" + facts(s) + glossary();
  html += fmt::format("\n<footer>Written by farfeel.{}</footer>\n</main>\n",
                      report_script().empty() ? "" : " Plots by uPlot (MIT licence), included.");
  html += fmt::format("<script id=\"trace\" type=\"application/json\">{}</script>\n", trace_json(trace));
  html += fmt::format("<script>{}</script>\n</body>\n</html>\n", report_script());
  return html;
}

tl::expected<void, ReportError> write_summary(const std::string& folder, const SessionSummary& summary) {
  return write_file(folder + "/" + kSummaryFile, to_json(summary));
}

tl::expected<SessionSummary, ReportError> read_summary(const std::string& folder) {
  const auto json = file_bytes(folder + "/" + kSummaryFile);
  if (!json)
    return tl::unexpected(ReportError{
        fmt::format("could not read {}/{}: give the folder a session wrote (--out)", folder, kSummaryFile)});
  return summary_from_json(*json);
}

tl::expected<std::string, ReportError> write_report(const std::string& folder) {
  const auto summary = read_summary(folder);
  if (!summary) return tl::unexpected(summary.error());
  const auto trace = read_session_csv(folder + "/" + kCsvFile);
  if (!trace) return tl::unexpected(trace.error());
  const ReportPictures pictures = {file_bytes(folder + "/" + kScenePicture).value_or(""),
                                   file_bytes(folder + "/" + kContactsPicture).value_or(""),
                                   file_bytes(folder + "/" + kNoPicture).value_or("")};
  std::string path = folder + "/" + kReportFile;
  if (const auto written = write_file(path, report_html(*summary, *trace, pictures)); !written)
    return tl::unexpected(written.error());
  return path;
}

}  // namespace farfeel::master_station
