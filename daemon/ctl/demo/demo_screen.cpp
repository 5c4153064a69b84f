#include "daemon/ctl/demo/demo_screen.hpp"

#include <utility>

#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

const std::vector<ScreenColumn>& demo_columns() {
  static const std::vector<ScreenColumn> columns{{"pair", 9},    {"mode", 10},  {"range m", 9},
                                                 {"error m", 9}, {"deg", 7},    {"+-m", 8},
                                                 {"+-deg", 7},   {"age ms", 8}, {"first s", 9}};
  return columns;
}

std::string demo_line(const DemoRow& row, const ScreenFormat& format) {
  if (!row.known) {
    const std::string begin =
        screen_row(demo_columns(), {row.pair, toned_mode("none", format)}) + "  ";
    const std::size_t indent = columns_of(begin);
    return begin + wrapped(row.reason, format.columns, indent, indent);
  }
  const DemoRow::Known& known = *row.known;
  return screen_row(
      demo_columns(),
      {row.pair, toned_mode(known.mode, format), fixed(known.range_m, 2), fixed(known.error_m, 3),
       fixed(known.error_deg, 2), fixed(known.sigma_m, 3), fixed(known.sigma_deg, 2),
       fixed(known.age_ms, 1), row.first_pose_s ? fixed(*row.first_pose_s, 2) : ""});
}

std::string demo_help(const ScreenFormat& format) {
  return toned("Keys", Tone::kTitle, format) + R"(
  q        end the demo and print its summary
  ?        this help; any other key closes it

)" + toned("Columns", Tone::kTitle, format) +
         R"(
  pair     observer->neighbor: the neighbor as the observer's daemon knows it
  mode     direct: measured by the observer; graph: located through other robots
           predicted: nothing is measured; none: no pose, and why
  range m  true distance of the two
  error    distance and angle between pose and truth, now
  +-       what the daemon says of its error: one sigma, in the worst direction
  age ms   between the time of the state and its publication
  first s  between the start of the daemons and the first pose
)";
}

}  // namespace

void DemoScreen::handle_key(char key) {
  if (key == 'q') quit_ = true;
  shows_help_ = key == '?' && !shows_help_;
}

std::string DemoScreen::text(const std::string& head, const std::vector<DemoRow>& rows,
                             const ScreenFormat& format) const {
  if (shows_help_) return demo_help(format);
  std::string text = head + "\n" + screen_titles(demo_columns(), format) + "\n";
  for (const DemoRow& row : rows) text += demo_line(row, format) + "\n";
  if (!format.is_interactive) return text;
  return text + "\n" +
         toned("direct: measured now   graph: by way of others   predicted: by IMUs", Tone::kDim,
               format) +
         "\n" + toned("q end   ? help", Tone::kDim, format) + "\n";
}

}  // namespace crepes
