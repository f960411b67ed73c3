// Controllers of any law with its frame, alone and supervised (forms.hpp).
#include "controllers.hpp"
#include "describe_control.hpp"
#include "describe_plant.hpp"
#include "srm/sim/desk.hpp"

namespace bound {

namespace {

/// `make(called law)` where its form is here; else `others()`.
template <class Make, class Others>
AnyController with_law(const AnyLaw& law, const Make& make, const Others& others) {
  const auto of = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) -> AnyController {
    if constexpr (has_form<forms_here, T, N>) {
      return make(called);
    } else {
      return others();
    }
  };
  return std::visit([&](const auto& any) { return std::visit(of, any); }, law.called);
}

using Events = std::shared_ptr<std::vector<srm::Event>>;

template <class Drive>
AnyController sampled(const Drive& drive, const srm::Supervision& plan,
                      const std::shared_ptr<const void>& memory) {
  const Events events = std::make_shared<std::vector<srm::Event>>();
  AnyController made{srm::Controller<Drive::N>(
      [drive, plan, memory, events, x = srm::SupervisedState<Drive>{}](
          const srm::Measurement<double, Drive::N>& y, double reference) mutable {
        srm::Orders<Drive::N> orders = srm::step_supervised(drive, plan, x, y, reference);
        const auto& law = x.drive.control.law;
        orders.tau_ref = x.outputs.gate_enable ? double(law.frame.tau_ref) : 0.0;
        srm::assign(orders.learned, law.law.learned);
        srm::note(*events, drive, x, plan.T_s);
        return orders;
      })};
  made.events = [events] { return *events; };
  return made;
}

}  // namespace

template <>
AnyController controlled<forms_here>(const AnyLaw& law, const srm::Frame<double>& given) {
  const auto around = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) {
    srm::DriveControl<srm::CalledLaw<T, N>> control{called};
    srm::assign(control.frame, given);
    AnyController made{srm::on_desk(control, nullptr)};
    if (law.describe != nullptr) {
      made.description = [law, frame = control.frame] { return described_controller(law, frame); };
    }
    return made;
  };
  return with_law(law, around, [&] { return controlled<Forms::other>(law, given); });
}

template <>
AnyController supervised<forms_here>(const AnyLaw& law, const srm::Frame<double>& frame,
                                     const AnyMachine& machine,
                                     const srm::Protection<double>& protection,
                                     const srm::Sequence<double>& sequence,
                                     const srm::Supervision& plan) {
  const auto around = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) {
    if (plan.phase < 0 || plan.phase >= N) throw std::invalid_argument("phase of the trouble");
    const auto guarded = [&]<class M>(const M& known, const srm::Tables& memory) {
      using Control = srm::DriveControl<srm::CalledLaw<T, N>>;
      srm::Supervised<srm::Guarded<M, Control>> drive{};
      drive.control.machine = known;
      srm::assign(drive.control.protection, protection);
      srm::assign(drive.control.control.frame, frame);
      drive.control.control.law = called;
      srm::assign(drive.sequence, sequence);
      AnyController made = sampled(drive, plan, memory.owner());
      if (law.describe != nullptr) {
        made.description = [law, drive, plan, owner = memory.owner()] {
          nb::dict tree = described_controller(law, drive.control.control.frame);
          tree["known"] = described(drive.control.machine);
          tree["protection"] = described(drive.control.protection);
          tree["sequence"] = described(drive.sequence);
          tree["supervision"] = described_part(plan);
          return tree;
        };
      }
      return made;
    };
    return with_machine<forms_here, T>(machine, guarded);
  };
  const auto others = [&] {
    return supervised<Forms::other>(law, frame, machine, protection, sequence, plan);
  };
  return with_law(law, around, others);
}

}  // namespace bound
