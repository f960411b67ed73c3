// Controllers of any law with its frame, alone and supervised (forms.hpp).
#include "called_machine.hpp"
#include "controllers.hpp"
#include "srm/c_api/blob.hpp"
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

/// The same function for other forms.
template <class Function>
Function* elsewhere(const char* name, Function*) {
  return other_form<Function>(name, Place::current().file_name());
}

/// The pairs that a control knows, their tables kept in the memory.
template <class Control>
void know(Control& control, const AnyCoupling& coupling, srm::Tables& memory) {
  if (!coupling) return;
  srm::assign(control.coupling, coupling->value, memory);
  if (const char* wrong = control.coupling.fault(Control::n_phases)) {
    throw std::invalid_argument(wrong);
  }
}

/// What leaves Python of a controller with these parameters.
template <class T, class P>
std::shared_ptr<const Exported> exported(const AnyLaw& law, const P& parameters,
                                         std::shared_ptr<const void> memory = {}) {
  if (law.itself.show == nullptr) return nullptr;
  return std::make_shared<const Exported>(
      Exported{law.itself, law.machine, std::is_same_v<T, float>, srm::c_api::around<P>(),
               [itself = law.itself, parameters, memory](srm::Archive& archive) {
                 Shower shower(archive, &itself);
                 srm::walk(shower, parameters);
               }});
}

template <class Drive>
AnyController sampled(const srm::SupervisedDrive<Drive>& drive,
                      const std::shared_ptr<const void>& memory) {
  const auto events = std::make_shared<std::vector<srm::Event>>();
  AnyController made{srm::Controller<Drive::N>(
      [drive, memory, events, x = typename srm::SupervisedDrive<Drive>::State{}](
          const srm::Measurement<double, Drive::N>& y, double reference) mutable {
        const srm::Orders<Drive::N> orders = step_on_desk(drive, x, y, reference);
        const srm::Event now = event_of(drive, x);
        if (events->empty() || events->back().mode != now.mode) events->push_back(now);
        return orders;
      })};
  made.events = [events] { return *events; };
  if constexpr (requires { drive.drive.control.flux_angle; }) {
    made.follows = drive.drive.control.flux_angle.on();
  }
  return made;
}

}  // namespace

template <>
AnyController controlled<forms_here>(const AnyLaw& law, const srm::Frame<double>& given,
                                     const AnyCoupling& coupling) {
  const auto around = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) {
    srm::DriveControl<srm::CalledLaw<T, N>> control{called};
    srm::Tables memory;
    srm::assign(control.frame, given);
    know(control, coupling, memory);
    AnyController made{srm::on_desk(control, memory.owner())};
    made.exported = exported<T>(law, control, memory.owner());
    return made;
  };
  return with_law(law, around, [&] {
    return elsewhere("controlled", &controlled<forms_here>)(law, given, coupling);
  });
}

template <>
AnyController supervised<forms_here>(const AnyLaw& law, const srm::Frame<double>& frame,
                                     const AnyMachine& machine,
                                     const srm::Protection<double>& protection,
                                     const srm::Sequence<double>& sequence,
                                     const srm::Supervision& plan, const AnyCoupling& coupling,
                                     const std::optional<srm::Diagnosis<double>>& diagnosis,
                                     const std::optional<srm::FluxAngle<double>>& flux_angle) {
  const auto around = [&]<class T, int N>(const srm::CalledLaw<T, N>& called) {
    if (plan.phase < 0 || plan.phase >= N) throw std::invalid_argument("phase of the trouble");
    const auto guarded = [&]<class M>(const M& known, srm::Tables& memory) {
      using Guarded = srm::Guarded<M, srm::DriveControl<srm::CalledLaw<T, N>>>;
      Guarded guarded;
      guarded.machine = known;
      srm::assign(guarded.protection, protection);
      srm::assign(guarded.control.frame, frame);
      guarded.control.law = called;
      know(guarded.control, coupling, memory);
      const auto made = [&]<class Control>(const Control& control) {
        srm::SupervisedDrive<srm::Supervised<Control>> given{{{}, control}, plan};
        srm::assign(given.drive.sequence, sequence);
        AnyController any = sampled(given, memory.owner());
        any.exported = exported<T>(law, given, memory.owner());
        return any;
      };
      if (!diagnosis) return made(guarded);
      srm::Diagnosed<Guarded> names{guarded, {}, {}};
      srm::assign(names.diagnosis, *diagnosis);
      if (flux_angle) srm::assign(names.flux_angle, *flux_angle);
      return made(names);
    };
    return with_machine<forms_here, T>(machine, guarded);
  };
  const auto others = [&] {
    return elsewhere("supervised", &supervised<forms_here>)(
        law, frame, machine, protection, sequence, plan, coupling, diagnosis, flux_angle);
  };
  return with_law(law, around, others);
}

template <>
void bind_controllers<forms_here>(nb::module_&) {
  add_other_form("controlled", &controlled<forms_here>);
  add_other_form("supervised", &supervised<forms_here>);
}

}  // namespace bound
