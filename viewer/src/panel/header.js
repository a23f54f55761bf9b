// The line at the top: which daemon, whether it answers, and what it costs.
import { write } from './dom.js';
import { megabytes } from './numbers.js';

export class Header {
  constructor(bar) {
    this.link = bar.querySelector('.link');
    this.text = bar.querySelector('.link-text');
    this.machine = bar.querySelector('.machine');
  }

  // tone: good, busy or bad
  say(text, tone) {
    this.link.dataset.tone = tone;
    write(this.text, text);
  }

  // stats: null where nobody says what the daemon costs
  update(stats) {
    if (!stats) {
      write(this.machine, '');
      return;
    }
    const parts = [`${stats.cpu_percent.toFixed(1)} % cpu`, megabytes(stats.rss_bytes)];
    if (stats.replay_file) parts.unshift(`replay of ${stats.replay_file}`);
    write(this.machine, parts.join('   '));
  }
}
