/// Charts as SVG text, for a page of results.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// x increases along a series. A step of x wider than the chart's `gap` breaks its line.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
};
using Series = std::vector<ChartPoint>;

/// At most `buckets` pairs of smallest and largest y, in order, so that no peak is lost. Short
/// series stay unchanged.
[[nodiscard]] Series decimated(const Series& series, std::size_t buckets);

/// The ticks of an axis from `low` to `high`: about `count`, spaced by 1, 2 or 5 times a power of
/// ten.
[[nodiscard]] std::vector<double> nice_ticks(double low, double high, int count);

/// Escapes `&`, `<`, `>` and quotes for XML.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// One pair of axes. The axes fit the content unless a range is set. Colors are those of CSS, and
/// may be variables of the page's style sheet.
class SvgChart {
 public:
  /// The texts of a chart.
  struct Labels {
    std::string title;
    std::string x;
    std::string y;
  };
  /// Of a chart [px].
  struct Size {
    int width = 520;
    int height = 190;
  };

  explicit SvgChart(Labels labels) : SvgChart(std::move(labels), Size{}) {}
  SvgChart(Labels labels, Size size) : labels_(std::move(labels)), size_(size) {}

  void set_x_range(double low, double high) { x_range_ = Range{low, high}; }
  void set_y_range(double low, double high) { y_range_ = Range{low, high}; }
  /// Lines break where x steps by more.
  void set_gap(double gap) { gap_ = gap; }

  /// `name` appears in the legend, unless empty.
  void add_line(const Series& series, std::string_view color, std::string_view name);
  /// Filled between +y and -y about `center`, both of the same x.
  void add_band(const Series& center, const Series& half_width, std::string_view color,
                std::string_view name);
  /// Points beyond the axes are drawn at the border.
  void add_points(const Series& series, std::string_view color, std::string_view name);
  /// Dashed, across the whole chart.
  void add_level(double y, std::string_view name);
  /// Columns from 0 to y, of width `width` to the right of x.
  void add_bars(const Series& series, double width, std::string_view color);
  /// Rectangles of full height.
  void add_spans(const std::vector<ChartPoint>& from_to, std::string_view color,
                 std::string_view name);

  [[nodiscard]] std::string svg() const;

 private:
  struct Range {
    double low;
    double high;
  };
  enum class Kind { kLine, kBand, kPoints, kLevel, kBars, kSpans };
  struct Layer {
    Kind kind;
    Series series;
    Series half_width;
    double value;  ///< of a level; width of bars
    std::string color;
    std::string name;
  };
  struct Frame;

  void add(Kind kind, const Series& series, std::string_view color, std::string_view name);
  [[nodiscard]] Frame frame() const;
  [[nodiscard]] std::string drawn(const Layer& layer, const Frame& frame) const;

  Labels labels_;
  Size size_;
  std::optional<Range> x_range_;
  std::optional<Range> y_range_;
  double gap_ = 1e300;
  std::vector<Layer> layers_;
};

}  // namespace crepes
