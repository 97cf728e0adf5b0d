// Moves flightlib's rigid body for a number of steps of 1 ms. See docs/peers.md.
#include <cstdlib>

#include "flightlib/common/integrator_rk4.hpp"
#include "flightlib/dynamics/quadrotor_dynamics.hpp"

using namespace flightlib;

static const Scalar kPeriod = 1e-3;

static QuadState start() {
  QuadState state;
  state.setZero();
  state.x(QS::POSZ) = 50.0;
  state.x(QS::ATTW) = 1.0;
  return state;
}

static bool integrate(long steps) {
  const QuadrotorDynamics dynamics(1.0, 0.25);
  const IntegratorRK4 integrator(dynamics.getDynamicsFunction(), kPeriod);
  QuadState state = start(), next = state;
  state.x(QS::OMEX) = 0.5;
  for (long step = 0; step < steps; ++step) {
    if (!integrator.step(state.x, kPeriod, next.x)) return false;
    state.x = next.x;
  }
  return state.x.allFinite();
}

int main(int count, char **words) {
  if (count != 2) return 2;
  return integrate(std::atol(words[1])) ? 0 : 1;
}
