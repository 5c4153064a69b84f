#include "daemon/ctl/score/svg_chart.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

// Around the plotting area [px].
constexpr double kLeft = 62.0;
constexpr double kRight = 10.0;
constexpr double kTop = 38.0;
constexpr double kBottom = 34.0;
constexpr double kLegendStep = 14.0;

std::string tick_text(double value) {
  return fmt::format("{:g}", std::abs(value) < 1e-12 ? 0.0 : value);
}

std::string label(double x, double y, std::string_view attributes, std::string_view text) {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' {}>{}</text>", x, y, attributes,
                     xml_escaped(text));
}

}  // namespace

Series decimated(const Series& series, std::size_t buckets) {
  if (series.size() <= 2 * buckets) return series;
  Series thin;
  thin.reserve(2 * buckets);
  const auto by_y = [](const ChartPoint& a, const ChartPoint& b) { return a.y < b.y; };
  for (std::size_t i = 0; i < buckets; ++i) {
    const auto first = series.begin() + static_cast<std::ptrdiff_t>(i * series.size() / buckets);
    const auto last =
        series.begin() + static_cast<std::ptrdiff_t>((i + 1) * series.size() / buckets);
    auto [low, high] = std::minmax_element(first, last, by_y);
    if (high < low) std::swap(low, high);
    thin.push_back(*low);
    if (high != low) thin.push_back(*high);
  }
  return thin;
}

std::vector<double> nice_ticks(double low, double high, int count) {
  CREPES_EXPECT(low < high && count > 0, "ticks need an axis");
  const double rough = (high - low) / count;
  const double magnitude = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * magnitude;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * magnitude < rough) continue;
    step = factor * magnitude;
    break;
  }
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1.0)
    ticks.push_back(k * step);
  return ticks;
}

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// Where numbers lie on the picture.
struct SvgChart::Frame {
  Range x;
  Range y;
  double left, right, top, bottom;  ///< [px]

  [[nodiscard]] double u(double value) const {
    return left + (right - left) * (value - x.low) / (x.high - x.low);
  }
  [[nodiscard]] double v(double value) const {
    return bottom - (bottom - top) * (value - y.low) / (y.high - y.low);
  }
  [[nodiscard]] std::string at(double px_x, double px_y) const {
    return fmt::format("{:.1f},{:.1f}", std::clamp(u(px_x), left, right),
                       std::clamp(v(px_y), top, bottom));
  }
};

void SvgChart::add(Kind kind, const Series& series, std::string_view color, std::string_view name) {
  layers_.push_back({kind, series, {}, 0.0, std::string(color), std::string(name)});
}

void SvgChart::add_line(const Series& series, std::string_view color, std::string_view name) {
  add(Kind::kLine, series, color, name);
}

void SvgChart::add_band(const Series& center, const Series& half_width, std::string_view color,
                        std::string_view name) {
  CREPES_EXPECT(center.size() == half_width.size(), "a band has as many centers as widths");
  add(Kind::kBand, center, color, name);
  layers_.back().half_width = half_width;
}

void SvgChart::add_points(const Series& series, std::string_view color, std::string_view name) {
  add(Kind::kPoints, series, color, name);
}

void SvgChart::add_level(double y, std::string_view name) {
  add(Kind::kLevel, {}, "var(--soft)", name);
  layers_.back().value = y;
}

void SvgChart::add_bars(const Series& series, double width, std::string_view color) {
  add(Kind::kBars, series, color, {});
  layers_.back().value = width;
}

void SvgChart::add_spans(const std::vector<ChartPoint>& from_to, std::string_view color,
                         std::string_view name) {
  add(Kind::kSpans, from_to, color, name);
}

SvgChart::Frame SvgChart::frame() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Range x{kInfinity, -kInfinity};
  Range y{kInfinity, -kInfinity};
  const auto cover = [](Range& range, double value) {
    range = {std::min(range.low, value), std::max(range.high, value)};
  };
  for (const Layer& layer : layers_) {
    if (layer.kind == Kind::kLevel || layer.kind == Kind::kBars)
      cover(y, layer.kind == Kind::kBars ? 0.0 : layer.value);
    for (std::size_t i = 0; i < layer.series.size(); ++i) {
      const ChartPoint& point = layer.series[i];
      const double half = layer.kind == Kind::kBand ? layer.half_width[i].y : 0.0;
      cover(x, point.x);
      if (layer.kind == Kind::kSpans) {
        cover(x, point.y);
        continue;
      }
      if (layer.kind == Kind::kBars) cover(x, point.x + layer.value);
      cover(y, point.y - half);
      cover(y, point.y + half);
    }
  }
  const auto widened = [](Range range, double part) {
    if (!(range.low <= range.high)) return Range{0.0, 1.0};
    const double more = std::max(part * (range.high - range.low), 1e-9);
    return Range{range.low - more, range.high + more};
  };
  return {.x = x_range_.value_or(widened(x, 0.0)),
          .y = y_range_.value_or(widened(y, 0.05)),
          .left = kLeft,
          .right = size_.width - kRight,
          .top = kTop,
          .bottom = size_.height - kBottom};
}

std::string SvgChart::drawn(const Layer& layer, const Frame& frame) const {
  std::string out;
  const Series& s = layer.series;
  switch (layer.kind) {
    case Kind::kLine:
      out = fmt::format("<path fill='none' stroke='{}' stroke-width='1.2' d='", layer.color);
      for (std::size_t i = 0; i < s.size(); ++i)
        out += (i == 0 || s[i].x - s[i - 1].x > gap_ ? "M" : "L") + frame.at(s[i].x, s[i].y);
      return out + "'/>";
    case Kind::kBand: {
      out = fmt::format("<path fill='{}' fill-opacity='0.18' d='", layer.color);
      for (std::size_t first = 0; first < s.size();) {
        std::size_t last = first + 1;
        while (last < s.size() && s[last].x - s[last - 1].x <= gap_) ++last;
        for (std::size_t i = first; i < last; ++i)
          out += (i == first ? "M" : "L") + frame.at(s[i].x, s[i].y + layer.half_width[i].y);
        for (std::size_t i = last; i-- > first;)
          out += "L" + frame.at(s[i].x, s[i].y - layer.half_width[i].y);
        out += "Z";
        first = last;
      }
      return out + "'/>";
    }
    case Kind::kPoints:
      // Round caps of lines without length: a dot needs only a dozen characters.
      out =
          fmt::format("<path fill='none' stroke-linecap='round' stroke-width='2.6' stroke='{}' d='",
                      layer.color);
      for (const ChartPoint& point : s) out += fmt::format("M{}h0", frame.at(point.x, point.y));
      return out + "'/>";
    case Kind::kLevel:
      return fmt::format("<path stroke='{}' stroke-dasharray='5 3' d='M{}L{}'/>", layer.color,
                         frame.at(frame.x.low, layer.value), frame.at(frame.x.high, layer.value));
    case Kind::kBars:
    case Kind::kSpans:
      out = fmt::format("<path fill='{}' d='", layer.color);
      for (const ChartPoint& p : s) {
        const bool bars = layer.kind == Kind::kBars;
        const double right = bars ? p.x + layer.value : p.y;
        const double high = bars ? p.y : frame.y.high;
        const double low = bars ? 0.0 : frame.y.low;
        out += fmt::format("M{}L{}L{}L{}Z", frame.at(p.x, low), frame.at(p.x, high),
                           frame.at(right, high), frame.at(right, low));
      }
      return out + "'/>";
  }
  return out;
}

std::string SvgChart::svg() const {
  const Frame f = frame();
  std::string out = fmt::format("<svg viewBox='0 0 {0} {1}' width='{0}' height='{1}' role='img'>",
                                size_.width, size_.height);
  out += label(kLeft, 13, "class='title'", labels_.title);
  const bool has_y = !labels_.y.empty();
  if (has_y) {
    for (const double tick : nice_ticks(f.y.low, f.y.high, 5)) {
      out +=
          fmt::format("<path class='grid' d='M{:.1f},{:.1f}H{:.1f}'/>", f.left, f.v(tick), f.right);
      out += label(f.left - 5, f.v(tick) + 3.5, "class='tick' text-anchor='end'", tick_text(tick));
    }
    out += fmt::format(
        "<text class='axis' transform='translate(12,{:.1f}) rotate(-90)' "
        "text-anchor='middle'>{}</text>",
        0.5 * (f.top + f.bottom), xml_escaped(labels_.y));
  }
  for (const double tick : nice_ticks(f.x.low, f.x.high, 8)) {
    out +=
        fmt::format("<path class='grid' d='M{:.1f},{:.1f}V{:.1f}'/>", f.u(tick), f.top, f.bottom);
    out += label(f.u(tick), f.bottom + 13, "class='tick' text-anchor='middle'", tick_text(tick));
  }
  out += label(0.5 * (f.left + f.right), size_.height - 5.0, "class='axis' text-anchor='middle'",
               labels_.x);
  double legend = kLeft;
  for (const Layer& layer : layers_) {
    out += drawn(layer, f);
    if (layer.name.empty()) continue;
    out += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='9' height='9' fill='{}'{}/>", legend,
                       kTop - 14, layer.color,
                       layer.kind == Kind::kBand ? " fill-opacity='0.35'" : "");
    out += label(legend + 12, kTop - 6, "class='tick'", layer.name);
    legend += kLegendStep + 14.0 + 5.6 * static_cast<double>(layer.name.size());
  }
  out += fmt::format("<rect class='frame' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'/>",
                     f.left, f.top, f.right - f.left, f.bottom - f.top);
  return out + "</svg>";
}

}  // namespace crepes
