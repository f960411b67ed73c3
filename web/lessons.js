// Guided lessons. Each sets the drive and says what to see; `at` holds values of a drive file.
export const LESSONS = [
  {
    title: "Why torque ripples",
    drive: "single_pulse",
    at: {},
    text: `Each phase gives torque only while its poles approach each other. Here every phase gets one
      voltage pulse per stroke, without current control. The torque is the sum of the phases, and it
      sags where one phase ends before the next one has built up its current.`,
    look: "Compare the torque with the currents below it. The ripple is peak to peak over mean.",
  },
  {
    title: "Turn on earlier",
    drive: "single_pulse",
    at: { "control.theta_on_deg": -20 },
    text: `Current needs time to rise, and at the unaligned position the inductance is smallest. An
      earlier turn-on angle builds up the current before the poles overlap, so the mean torque rises.
      Turning off too late costs braking torque past alignment.`,
    look: "Move the turn-on and turn-off angles; watch the mean torque and the copper loss.",
  },
  {
    title: "Share the torque",
    drive: "sharing",
    at: {},
    text: `A torque sharing function divides the reference between the outgoing and the incoming phase.
      Each share becomes a current reference (dashed). Hysteresis control keeps the current within its
      band, so the sum of the phases follows the reference.`,
    look: "The torque now stays near its dashed reference. Widen the current band: the ripple grows.",
  },
  {
    title: "Speed takes the voltage",
    drive: "sharing",
    at: { "load.speed_rpm": 3000 },
    text: `At twice the speed the current has half the time to rise and fall, and the back-EMF uses up
      the voltage. The current no longer follows its reference, and ripple returns.`,
    look: "Raise the dc-link voltage or lower the torque reference until the current follows again.",
  },
  {
    title: "What sensors and models cost",
    drive: "sharing",
    at: { "mismatch.flux_factor": 0.9, "sensing.adc_bits": 6 },
    text: `The controller computes its current references from a model of the machine. Here that model
      has 10 % too little flux, and the currents are read with 6 bits. The torque misses its reference
      although every current is controlled.`,
    look: "Compare the mean torque with its reference. Then set the flux factor back to 1.",
  },
  {
    title: "What the predictive law does",
    drive: "edge_mpc",
    at: {},
    text: `The predictive law computes from the model which switching instants keep the torque on its
      reference over the next period, and it prices each switching. It follows a profile of least
      copper loss and places edges within the control period.`,
    look: "Compare ripple, switching frequency and copper loss with the lesson on sharing; then with "
      + "the physical limit in the second column.",
  },
  {
    title: "A drive starts, and meets a fault",
    drive: "supervised",
    at: {},
    text: `The same states and protection as in the firmware stand around the control. The dc link is
      charged, the current sensors are calibrated, and the drive runs. The diagnosis first magnetizes
      each phase alone. Then a sensor shows too much current: the gates are off within one control
      period. The fault stays until it is cleared while the drive is not enabled.`,
    look: "Go from state to state with the buttons below the charts; then choose another fault.",
  },
];
