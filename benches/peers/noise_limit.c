/* What a vectorised, counter-based noise kernel reaches on this machine, without exactness: two normal deviates a pixel.
 * gcc -O3 -march=native -ffast-math -fopenmp noise_limit.c -o noise_limit -lm; noise_limit [threads=1] [repetitions=7]
 * The last line is the limit: Philox 4x32-10 twice, a Cornish-Fisher Poisson count and a normal read noise, 16-bit numbers.
 */
#include <stdio.h>
#include <stdlib.h>
#include <stdint.h>
#include <math.h>
#include <time.h>
#include <omp.h>
#define W 4096
#define N (4096L*4096L)
static double cpu(void){struct timespec t;clock_gettime(CLOCK_PROCESS_CPUTIME_ID,&t);return t.tv_sec+1e-9*t.tv_nsec;}
static double now(void){struct timespec t;clock_gettime(CLOCK_MONOTONIC,&t);return t.tv_sec+1e-9*t.tv_nsec;}
static inline void philox(uint32_t i,uint32_t row,uint32_t key,uint32_t o[4]){uint32_t c0=i,c1=row,c2=0,c3=0,k0=key,k1=0xdecafbad;
 #pragma GCC unroll 10
 for(int r=0;r<10;r++){uint64_t a=(uint64_t)0xD2511F53u*c0,b=(uint64_t)0xCD9E8D57u*c2;uint32_t n0=(uint32_t)(b>>32)^c1^k0,n2=(uint32_t)(a>>32)^c3^k1;c1=(uint32_t)b;c3=(uint32_t)a;c0=n0;c2=n2;k0+=0x9E3779B9u;k1+=0xBB67AE85u;}
 o[0]=c0;o[1]=c1;o[2]=c2;o[3]=c3;}
static inline float invn(uint32_t u){float x=((int32_t)u)*0x1p-31f+0x1p-32f;float w=-logf((1.0f-x)*(1.0f+x)+1e-20f);
 float a=w-2.5f,p=2.81022636e-08f;p=3.43273939e-07f+p*a;p=-3.5233877e-06f+p*a;p=-4.39150654e-06f+p*a;p=0.00021858087f+p*a;p=-0.00125372503f+p*a;p=-0.00417768164f+p*a;p=0.246640727f+p*a;p=1.50140941f+p*a;
 float b=sqrtf(w)-3.0f,q=-0.000200214257f;q=0.000100950558f+q*b;q=0.00134934322f+q*b;q=-0.00367342844f+q*b;q=0.00573950773f+q*b;q=-0.0076224613f+q*b;q=0.00943887047f+q*b;q=1.00167406f+q*b;q=2.83297682f+q*b;
 return 1.41421356f*x*(w<5.0f?p:q);}
static int reps=7;static int cmp(const void*a,const void*b){double x=*(double*)a,y=*(double*)b;return (x>y)-(x<y);}
#define BENCH(name,...) do{double T[64],U[64];for(int q=0;q<reps;q++){double t0=now(),c0=cpu();{__VA_ARGS__;}T[q]=now()-t0;U[q]=cpu()-c0;}qsort(T,reps,8,cmp);qsort(U,reps,8,cmp);printf("%-52s best %8.1f median %8.1f Mpx/s by-cpu %8.1f (wall best %.4f, cpu median %.4f s/frame)\n",name,N/1e6/T[0],N/1e6/T[reps/2],N/1e6/U[reps/2],T[0],U[reps/2]);fflush(stdout);}while(0)
static inline uint16_t q16(float f){int v=(int)(f+0.5f);v=v<0?0:v>65535?65535:v;return (uint16_t)((v>>8)|(v<<8));}
#define LINE(...) _Pragma("omp parallel for schedule(static)") for(int y=0;y<W;y++){float*mm=m+(long)y*W;uint16_t*oo=o+(long)y*W;uint32_t R[4][1024] __attribute__((aligned(64)));\
 for(int i=0;i<1024;i++){uint32_t t[4];philox(i,y,key,t);R[0][i]=t[0];R[1][i]=t[1];R[2][i]=t[2];R[3][i]=t[3];} const uint32_t*r=&R[0][0]; __VA_ARGS__ }
int main(int c,char**v){int th=c>1?atoi(v[1]):1;if(c>2)reps=atoi(v[2]);omp_set_num_threads(th);printf("threads %d\n",th);uint32_t key=1;
 float*m=malloc(N*4);uint16_t*o=malloc(N*2);for(long i=0;i<N;i++){m[i]=1500+(i%4096)*0.01f;o[i]=0;}
 BENCH("philox4x32-10 u32 per px",LINE(for(int x=0;x<W;x++)oo[x]=r[x];)key++);
 BENCH("philox + 1 normal per px, sqrt(m+rn2) -> u16",LINE(for(int x=0;x<W;x++){float z=invn(r[x]),s=sqrtf(mm[x]+100.f);oo[x]=q16(mm[x]+100.f+s*z);})key++);
 BENCH("philox + 1 normal + Cornish-Fisher -> u16",LINE(for(int x=0;x<W;x++){float z=invn(r[x]),V=mm[x]+100.f,s=sqrtf(V),g=mm[x]/V;oo[x]=q16(mm[x]+100.f+s*z+g*(z*z-1)*(1.f/6));})key++);
 double sm=0,s2=0,s3=0;for(long i=0;i<N;i++){int k=(uint16_t)((o[i]>>8)|(o[i]<<8));double d=k-100-m[i];sm+=d;s2+=d*d;s3+=d*d*d;}double vv=s2/N-sm*sm/N/N;printf("   check: mean %.4f var/expected %.5f skew %.5f\n",sm/N,(vv-1/12.)/(1520.5+100),s3/N/pow(vv,1.5));
 BENCH("2x philox + 2 normals (CF Poisson rounded, read)",LINE(uint32_t S[4096] __attribute__((aligned(64)));for(int i=0;i<1024;i++){uint32_t t[4];philox(i,y+9999,key,t);S[i]=t[0];S[i+1024]=t[1];S[i+2048]=t[2];S[i+3072]=t[3];}
  for(int x=0;x<W;x++){float z=invn(r[x]),s=sqrtf(mm[x]);float k=floorf(mm[x]+s*z+(z*z-1)*(1.f/6)+0.5f);oo[x]=q16(k+10.f*invn(S[x])+100.f);})key++);
 return 0;}
