// Programs that the tests start, and end.
import { spawn, spawnSync } from 'node:child_process';

/** Runs a program to its end, which must be a good one. */
export function run(command) {
  const { status, stderr } = spawnSync(command[0], command.slice(1), { encoding: 'utf8' });
  if (status !== 0) throw new Error(`${command.join(' ')} ended with ${status}: ${stderr}`);
}

/** Starts a program and waits for the line that says where it is. */
export function launch(command, ready) {
  const program = spawn(command[0], command.slice(1), { stdio: ['pipe', 'pipe', 'pipe'] });
  let said = '';
  let wrong = '';
  program.stderr.on('data', (text) => { wrong += text; });
  return new Promise((done, fail) => {
    program.on('exit', (status) => fail(new Error(`${command.join(' ')} ended with ${status}: ${wrong}`)));
    program.stdout.on('data', (text) => {
      said += text;
      const found = ready.exec(said);
      if (found) done({ address: found[1], stop: () => { program.removeAllListeners('exit'); program.stdin.end(); program.kill(); } });
    });
  });
}
