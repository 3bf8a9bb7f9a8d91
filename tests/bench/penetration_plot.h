// A plot of cost against error on logarithmic axes, as SVG, with the points nothing else beats joined by a line.
#pragma once

#include <string>
#include <vector>

namespace farfeel::bench {

struct PlotPoint {
  std::string label, group;  ///< a tooltip; points of one group share a colour
  double x, y;               ///< > 0; smaller is better
};

void write_pareto_plot(const std::string& path, const std::string& x_title, const std::string& y_title,
                       const std::vector<PlotPoint>& points);

}  // namespace farfeel::bench
