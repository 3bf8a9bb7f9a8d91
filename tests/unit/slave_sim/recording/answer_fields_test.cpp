#include "slave_sim/recording/answer_fields.h"

#include <gtest/gtest.h>

#include "tests/support/tiled_plates.h"

namespace farfeel::slave_sim {
namespace {

contact_service::Answer set_of(std::initializer_list<std::uint32_t> ids) {
  contact_service::Answer set;
  for (const std::uint32_t id : ids) set.contacts[set.count++].id = id;
  return set;
}

std::vector<double> names_in(const codecs::Outputs& outputs) {
  for (const codecs::Output& output : outputs)
    if (output.name == "contacts' names") return output.values;
  return {};
}

TEST(AnswerOutputs, NameContactsByWhenTheyCameWhateverTheirIds) {
  AnswerOutputs outputs;
  const auto names_of = [&](std::initializer_list<std::uint32_t> ids) { return names_in(outputs.of(set_of(ids), {})); };
  EXPECT_EQ(names_of({70, 9}), (std::vector<double>{1, 2}));
  EXPECT_EQ(names_of({9, 70, 3}), (std::vector<double>{2, 1, 3}));
  EXPECT_EQ(names_of({3}), (std::vector<double>{3}));
  EXPECT_EQ(names_of({3, 9}), (std::vector<double>{3, 4})) << "an id that comes back is another contact's";
}

TEST(AnswerFields, OptionsAreReadAsTheyWereWritten) {
  const contact_service::ContactOptions options{
      .tolerance_m = 1e-3, .grid_samples = 30, .most_stiffness_N_per_m = 5000};
  const codecs::Numbers numbers = numbers_of(RecordedOptions{options, true});
  codecs::NumberReader read(numbers.names, numbers.values);
  const auto again = options_in(read);
  ASSERT_TRUE(again);
  EXPECT_EQ(numbers_of(*again), numbers);
  EXPECT_EQ(read.unasked(), "");
}

TEST(AnswerFields, AbsurdOptionsAreRefused) {
  for (const auto& options : {contact_service::ContactOptions{.tolerance_m = 0},
                              {.tolerance_m = std::nan("")},
                              {.grid_samples = 0},
                              {.grid_samples = 1u << 30},
                              {.soft_width_m = -1}}) {
    const codecs::Numbers numbers = numbers_of(RecordedOptions{options, false});
    codecs::NumberReader read(numbers.names, numbers.values);
    EXPECT_FALSE(options_in(read));
  }
}

TEST(AnswerFields, AnEditIsReadAsItWasWritten) {
  SurfaceEdit edit{{1, 7}, {}};
  edit.tile.version = 3, edit.tile.coefficients[5] = 77;
  const auto again = edit_in(message_of(edit));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->where, edit.where);
  EXPECT_EQ(again->tile.version, 3);
  EXPECT_EQ(again->tile.coefficients, edit.tile.coefficients);
  EXPECT_FALSE(edit_in({kEdit, std::vector<std::byte>(7)}));
}

}  // namespace
}  // namespace farfeel::slave_sim
