// Two simulated sessions of one patient-like arm on MIT-MANUS, made by the program itself when they are asked for.
(() => {
  // The joint matrices of the built-in study `arm`; after the training the arm is stiffer and damped more.
  const SESSIONS = {
    before: { seed: 1, stiffness: '[[67.0, 28.0], [28.0, 40.5]]', damping: '[[2.46, 1.05], [1.05, 1.27]]' },
    after: { seed: 2, stiffness: '[[84.0, 33.0], [33.0, 49.0]]', damping: '[[2.80, 1.15], [1.15, 1.40]]' },
  };
  const experiment = ({ seed, stiffness, damping }) => `
schema = "ndof/experiment/1"
seed = ${seed}
trials = 3
duration_s = 50.0
sample_rate_hz = 500.0
[device]
name = "mit-manus"
[limb]
name = "planar-two-link"
K = ${stiffness}
B = ${damping}
handle_mass_kg = 0.6
mean_force_n = [5.0, -6.0]
noise = { rms_n = 0.5, cutoff_hz = 2.0 }
[posture]
joint_rad = [0.785398163397448, 1.5707963267949]
[excitation]
kind = "filtered-noise"
rms = 4.0
cutoff_hz = 15.0
`;
  const experiments = Object.fromEntries(Object.entries(SESSIONS).map(([name, session]) => [name, experiment(session)]));
  // The posture above, with links of 0.33 m and 0.34 m: where the hand is, seen from the shoulder.
  const ARM = { use: true, side: 'right', lengths_m: [0.33, 0.34], shoulder_m: [0, 0], hand_m: [-0.007, 0.474], mean_force: true };

  // The recordings, as [name, bytes, session].
  async function make(progress) {
    const made = [];
    for (const [k, [name, text]] of Object.entries(experiments).entries()) {
      const { files, errors, code } = await app.program.run(['simulate', `${name}.toml`, '--out', `${name}.csv`], { [`${name}.toml`]: new TextEncoder().encode(text) }, progress);
      if (code) throw new Error(app.program.sentences(errors).error);
      for (const file of Object.keys(files).filter(file => file.endsWith('.csv')).sort()) made.push([file, files[file], k + 1]);
    }
    return made;
  }

  app.sample = { make, experiments, arm: ARM };
})();
