// report.html: one session on one page that opens in any browser, without a network and without other files.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "master_station/report/session_summary.h"
#include "master_station/report/session_trace.h"

namespace farfeel::master_station {

/// What a session's folder holds, by name.
inline constexpr const char* kSummaryFile = "summary.json";
inline constexpr const char* kCsvFile = "session.csv";
inline constexpr const char* kReportFile = "report.html";
inline constexpr const char* kScenePicture = "scene.png";        ///< the whole scene
inline constexpr const char* kContactsPicture = "contacts.png";  ///< near the contacts
inline constexpr const char* kNoPicture = "no-picture.txt";      ///< why there is none

/// The pictures' bytes as PNG; empty where there is none, and then the reason.
struct ReportPictures {
  std::string scene_png, contacts_png;
  std::string why_none;
};

[[nodiscard]] std::string report_html(const SessionSummary&, const SessionTrace&, const ReportPictures&);

/// Writes summary.json into an existing folder.
[[nodiscard]] tl::expected<void, ReportError> write_summary(const std::string& folder, const SessionSummary&);
[[nodiscard]] tl::expected<SessionSummary, ReportError> read_summary(const std::string& folder);

/// Makes report.html from the summary, the CSV and the pictures that lie in the folder. Returns the page's path.
/// Takes some 0.2 s for a minute at 1 kHz; call it after the session, never beside a running haptic loop.
[[nodiscard]] tl::expected<std::string, ReportError> write_report(const std::string& folder);

}  // namespace farfeel::master_station
