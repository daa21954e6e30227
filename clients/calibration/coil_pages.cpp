#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "clients/calibration/coil_findings.hpp"
#include "clients/calibration/report_page.hpp"

namespace tubed {

namespace {

constexpr std::array<const char*, 6> kColours{"#1f5fa8", "#c0561a", "#2d8a4e",
                                              "#8a3fa0", "#a3282f", "#5b6770"};

std::string number(const char* format, double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string colour(std::size_t i) { return kColours.at(i % kColours.size()); }

ReportPage begin(const std::string& title, const ConfigurationFragment& fragment) {
  return ReportPage(title, fragment.found_by + ", " + fragment.date);
}

void end(const ConfigurationFragment& fragment, ReportPage& page) {
  page.heading("Remarks");
  for (const std::string& remark : fragment.remarks) {
    page.text(remark);
  }
}

/// Rows of sensor, before, found, change, sigma; those that change much are marked.
template <typename Coils>
void offsets_table(const Coils& coils, ReportPage& page) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> marked;
  for (std::size_t k = 0; k < coils.size(); ++k) {
    const auto& coil = coils[k];
    rows.push_back({std::to_string(k + 1), std::to_string(coil.sensor), number("%.1f", coil.stated_mm),
                    coil.was_found ? number("%.2f", coil.found_mm) : "stays",
                    coil.was_found ? number("%+.2f", coil.change_mm()) : "",
                    coil.was_found ? number("%.2f", coil.sigma_mm) : "", std::to_string(coil.measurements)});
    if (coil.was_found && std::abs(coil.change_mm()) > kNotedChange_mm) {
      marked.push_back(k);
    }
  }
  page.table({"coil", "sensor", "stated mm", "found mm", "change mm", "sigma mm", "measurements"}, rows,
             marked);
}

template <typename Coils>
void offsets_verdict(const Coils& coils, ReportPage& page) {
  double greatest = 0;
  for (const auto& coil : coils) {
    greatest = coil.was_found ? std::max(greatest, std::abs(coil.change_mm())) : greatest;
  }
  if (greatest > kNotedChange_mm) {
    page.verdict(ReportVerdict::kDoubtful,
                 "An arc length changes by " + number("%.1f mm", greatest) +
                     ": every shape changes. Is this the catheter that is configured?");
  } else {
    page.verdict(ReportVerdict::kGood, "Arc lengths are as stated, within " + number("%.1f mm.", greatest));
  }
}

/// Counts of values in bins of a histogram, as a line of steps.
PlotSeries histogram(const std::string& name, const std::string& colour, const std::vector<double>& values,
                     double reach) {
  constexpr int kBins = 40;
  std::array<int, kBins> counts{};
  for (const double value : values) {
    const double at = (value + reach) / (2 * reach) * kBins;
    if (at >= 0 && at < kBins) {
      ++counts.at(static_cast<std::size_t>(at));
    }
  }
  PlotSeries series{name, colour, {}, true};
  for (int bin = 0; bin < kBins; ++bin) {
    const double share =
        100.0 * counts.at(static_cast<std::size_t>(bin)) / static_cast<double>(values.size());
    series.points.push_back({-reach + 2 * reach * bin / kBins, share});
    series.points.push_back({-reach + 2 * reach * (bin + 1) / kBins, share});
  }
  return series;
}

void field_part(const FieldError& field, ReportPage& page) {
  page.heading("The field, by distance from the generator");
  std::vector<std::vector<std::string>> rows;
  PlotSeries points{"a place", colour(0), {}, false};
  for (const DistanceBand& band : field.bands) {
    rows.push_back({number("%.0f", band.from_mm) + number(" to %.0f", band.until_mm),
                    std::to_string(band.places), number("%.2f", band.rms_mm), number("%.2f", band.axis_mm)});
  }
  for (const PlaceError& place : field.places) {
    points.points.push_back({place.distance_mm, place.off_mm.norm()});
  }
  page.table({"distance mm", "places", "RMS mm", "an axis mm"}, rows);
  page.figure(180, "How far each place is off where the board has it, after the board was fitted",
              [&](Svg& svg, const ReportPage::Room& room) {
                draw_plot(svg, room, {"from the generator, mm", "off, mm"}, {points});
              });
}

}  // namespace

std::string page_of(const StraightCatheter& found, const ConfigurationFragment& fragment) {
  ReportPage page = begin("Arc lengths in a straight groove", fragment);
  for (const std::string& mistake : found.mistakes) {
    page.verdict(ReportVerdict::kBad, mistake);
  }
  offsets_verdict(found.coils, page);
  offsets_table(found.coils, page);
  std::vector<Bar> beside;
  std::vector<Bar> angles;
  for (std::size_t k = 0; k < found.coils.size(); ++k) {
    beside.push_back({"coil " + std::to_string(k + 1), found.coils[k].beside_mm});
    angles.push_back({"coil " + std::to_string(k + 1), found.coils[k].angle_deg});
  }
  page.figure(150, "Distance from the line through all coils",
              [&](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, beside, "mm", 3); });
  page.figure(150, "Angle between a coil's direction and the line toward the tip",
              [&](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, angles, "deg", 5); });
  end(fragment, page);
  return page.str();
}

std::string page_of(const ArcLengths& found, const ConfigurationFragment& fragment) {
  ReportPage page = begin("Arc lengths from a recording of the catheter in use", fragment);
  if (!found.has_end()) {
    page.verdict(ReportVerdict::kDoubtful, "The tube's end was not seen: distances between coils alone.");
  }
  offsets_verdict(found.coils, page);
  offsets_table(found.coils, page);
  std::vector<Bar> change;
  std::vector<Bar> sigma;
  for (std::size_t k = 0; k < found.pieces.size(); ++k) {
    const std::string name = std::to_string(k + 1) + " to " + std::to_string(k + 2);
    change.push_back({name, std::abs(found.pieces[k].found_mm - found.pieces[k].stated_mm)});
    sigma.push_back({name, found.pieces[k].sigma_mm});
  }
  page.figure(150, "By how much the distance of neighbouring coils is another than stated",
              [&](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, change, "mm", 2); });
  page.figure(150, "Its standard deviation",
              [&](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, sigma, "mm", 1); });
  end(fragment, page);
  return page.str();
}

std::string page_of(const StillNoise& noise, const FieldError* field, const ConfigurationFragment& fragment) {
  ReportPage page = begin("Noise of still coils", fragment);
  page.verdict(noise.remarks.empty() ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
               "White noise " + number("%.3f mm an axis", noise.position_mm) +
                   (noise.remarks.empty() ? ", nothing else found." : "; see the remarks."));
  std::vector<std::vector<std::string>> rows;
  std::vector<PlotSeries> histograms;
  const double reach = std::max(4 * noise.position_mm, 1e-3);
  for (std::size_t k = 0; k < noise.coils.size(); ++k) {
    const StillCoil& coil = noise.coils[k];
    rows.push_back({std::to_string(coil.sensor), number("%.3f", coil.white_mm.x()),
                    number("%.3f", coil.white_mm.y()), number("%.3f", coil.white_mm.z()),
                    number("%.5f", coil.tangent), number("%.4f", coil.averaged_mm),
                    number("%.4f", coil.expected_mm), number("%.2f", coil.drift_mm_min)});
    histograms.push_back(
        histogram("sensor " + std::to_string(coil.sensor), colour(k), coil.deviations_mm, reach));
  }
  page.table({"sensor", "x mm", "y mm", "z mm", "direction", "mean of 40", "white would", "drift mm/min"},
             rows);
  page.figure(220, "Deviations from the mean, all axes", [&](Svg& svg, const ReportPage::Room& room) {
    draw_plot(svg, room, {"mm", "% of measurements"}, histograms);
  });
  if (field != nullptr) {
    field_part(*field, page);
  }
  end(fragment, page);
  return page.str();
}

std::string page_of(const MovingNoise& noise, const FieldError* field,
                    const ConfigurationFragment& fragment) {
  ReportPage page = begin("Noise of moving coils", fragment);
  page.verdict(noise.remarks.empty() ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
               "White noise " + number("%.3f mm an axis", noise.position_mm) +
                   (noise.remarks.empty() ? ", as much while slow as while fast." : "; see the remarks."));
  std::vector<std::vector<std::string>> rows;
  std::vector<Bar> halves;
  for (const MovingCoil& coil : noise.coils) {
    rows.push_back({std::to_string(coil.sensor), std::to_string(coil.differences),
                    number("%.1f", coil.median_mm_s), number("%.3f", coil.noise_mm),
                    number("%.3f", coil.slow_noise_mm), number("%.3f", coil.fast_noise_mm),
                    number("%.5f", coil.tangent)});
    const std::string name = "sensor " + std::to_string(coil.sensor);
    halves.push_back({name + ", slower", coil.slow_noise_mm});
    halves.push_back({name + ", faster", coil.fast_noise_mm});
  }
  page.table({"sensor", "measurements", "median mm/s", "noise mm", "slower half", "faster half", "direction"},
             rows);
  page.figure(40.0 + 24 * static_cast<double>(halves.size()),
              "Noise while a coil is slower than usual, and faster",
              [&](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, halves, "mm"); });
  if (field != nullptr) {
    field_part(*field, page);
  }
  end(fragment, page);
  return page.str();
}

}  // namespace tubed
