// Numbers with their units, as people read them.

export function ms(value_ms) {
  if (!Number.isFinite(value_ms)) return '';
  if (value_ms >= 999.5) return `${(value_ms / 1000).toFixed(1)} s`;
  return `${value_ms.toFixed(value_ms < 99.95 ? 1 : 0)} ms`;
}

// Whether a picture of this age is no longer live.
export const isSlow = (picture_ms) => picture_ms > 1000;

export function signed(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return `${value < 0 && Number(text) !== 0 ? '−' : ''}${text}`;
}

// 0:12, as a clock shows it.
export function minutes(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

export const percent = (share) => `${Math.round(100 * share)} %`;

export const megabytes = (bytes) => `${(bytes / 1e6).toFixed(0)} MB`;
